"""Imports point downward, heavy libraries stay behind their doors; no folder, file or function outgrows a screen."""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).parents[1] / "simplexmesh"
TESTS = Path(__file__).parent

# Room -> the rooms it may import from, besides itself; the front is the package as users see it.
BASE = {"_base", "numerics"}
BELOW = {
    "_base": set(),
    "numerics": {"_base"},
    "mesh": BASE,
    "data": BASE | {"mesh"},
    "orientation": BASE | {"mesh", "data"},
    "motion": BASE | {"mesh", "data", "orientation", "surface"},
    "surface": BASE | {"mesh", "data", "orientation"},
    "recognition": BASE | {"mesh", "data", "orientation", "motion", "surface"},
    "cloud": BASE | {"mesh", "data", "orientation"},
    "plot": BASE | {"mesh", "data", "orientation", "motion", "surface", "recognition", "cloud"},
    "bench": BASE | {"mesh", "data", "surface", "plot", "front"},
    "cli": BASE | {"mesh", "data", "orientation", "motion", "surface", "recognition", "cloud", "plot", "front"},
}

# Imports that point up, each with its reason.
UPWARD = {
    ("_base/html.py", "simplexmesh.plot.surface"): "notebooks show results with a picture",
    ("mesh/simplex_mesh.py", "simplexmesh.data.triangles"): "users look for mesh.triangulated() on the mesh",
    ("_base/units.py", "simplexmesh.data.io.writing"): "users look for save() and to_pyvista() on all data",
    ("_base/named_arrays.py", "simplexmesh.data.exporting"): "users look for to_trimesh() and to_open3d() on all data",
    ("mesh/simplex_mesh.py", "simplexmesh.surface.curvature.estimate"): "users look for mesh.mean_curvature on it",
}

# Modules that import each other: none.
CIRCLES: set[frozenset[str]] = set()

# Heavy or special library -> the files that may name it, as patterns; `/` starts at the package.
# NumPy and the standard library are free.
DOORS = {
    "numba": ["_kernels*.py"],
    "igl": ["/mesh/decimation/certified.py", "/motion/targets/triangles.py", "/surface/curvature/classic/principal.py"],
    "skimage": ["/motion/start/solid_mesh.py"],
    "SimpleITK": ["/data/io/itk.py", "/data/io/writing.py"],
    "plyfile": ["/data/io/ply.py"],
    "laspy": ["/data/io/survey/las.py"],
    "lazrs": ["/data/io/survey/las.py"],
    "pye57": ["/data/io/survey/e57.py"],
    "OCP": ["/cloud/step.py"],
    "pyvista": [
        *("/plot/*.py", "/bench/charts.py", "/data/io/vtk.py", "/data/conversion.py", "/data/io/writing.py"),
        *("/cli/*.py", "/cloud/extraction/result.py", "/data/primitives/curve.py"),
    ],
    "vtkmodules": [
        *("/data/io/vtk.py", "/data/io/polydata.py", "/data/io/integrity/apart.py", "/data/cutting/clipping.py"),
        "/plot/stage.py",
    ],
    "trame_vtk": ["/plot/stage.py"],
    "trimesh": ["/data/exporting.py"],
    "open3d": ["/data/exporting.py"],
    "manifold3d": ["/data/cutting/boolean.py"],
    "scipy": ["/*/*.py", "/*/*/*.py", "/*/*/*/*.py"],
    "rich": ["/cli/*.py", "/_base/progress.py"],
    "typer": ["/cli/*.py"],
    "importlib": [  # imports by name hide
        *("/__init__.py", "/_base/html.py", "/mesh/simplex_mesh.py", "/motion/targets/__init__.py"),
        "/surface/registry.py",
    ],
}
FREE = (set(sys.stdlib_module_names) - set(DOORS)) | {"numpy"}

MOST_FILES = 15
LONGEST_FILE = 400
LONGEST_BODY = 70


def files() -> list[Path]:
    return [path for path in sorted(ROOT.rglob("*.py")) if "__pycache__" not in path.parts]


def imports(source: str) -> Iterator[str]:
    """Every module or name a source imports, wherever in the file; imports for type checkers only are left out."""
    nodes = list(ast.walk(ast.parse(source)))
    unreal = {
        inner
        for node in nodes
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in nodes:
        if node in unreal:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{'.' * node.level}{node.module or ''}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in {"import_module", "__import__"}:
                yield str(node.args[0].value)


def place_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def imports_of(path: Path) -> tuple[str, ...]:
    return tuple(imports(path.read_text(encoding="utf-8")))


def room(place: str) -> str:
    return place.split("/")[0].removesuffix(".py")


def wrong_directions(place: str, names: Iterable[str]) -> list[str]:
    """What is wrong with the imports of our own modules from the file at `place`."""
    found = []
    for name in names:
        head, *tail = name.split(".")
        if name.startswith("."):
            found.append(f"{place}: write absolute imports, not {name}")
        elif head == "simplexmesh" and place != "__init__.py":
            above = tail[0] if tail and tail[0] in BELOW else "front"
            reason = any(place == here and f"{name}.".startswith(f"{there}.") for here, there in UPWARD)
            if above != room(place) and above not in BELOW.get(room(place), set()) and not reason:
                found.append(f"{place}: {room(place)} must not import {name}")
    return found


def wrong_doors(place: str, names: Iterable[str]) -> list[str]:
    """Which libraries the file at `place` may not name."""
    found = []
    for name in names:
        head = name.split(".")[0]
        if head in FREE or head in {"simplexmesh", ""}:
            continue
        patterns = DOORS.get(head, [])
        if not any(PurePosixPath("/", place).match(pattern) for pattern in patterns):
            found.append(f"{place}: {head} belongs in {', '.join(patterns) or 'no file'}")
    return found


def module_names() -> dict[str, Path]:
    return {"simplexmesh." + ".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in files()}


def module_graph() -> dict[str, set[str]]:
    """Which of our modules each of them imports; the imports that point up happen later, in the call of a method."""
    known = module_names()
    return {
        module: {
            name if name in known else name.rpartition(".")[0]
            for name in imports_of(path)
            if {name, name.rpartition(".")[0]} & known.keys() and (place_of(path), name) not in UPWARD
        }
        for module, path in known.items()
    }


def reached_from(start: str, graph: Mapping[str, set[str]]) -> set[str]:
    """The modules that `start` imports, directly or by others."""
    found: set[str] = set()
    waiting = [start]
    while waiting:
        for following in graph.get(waiting.pop(), set()) - found:
            found.add(following)
            waiting.append(following)
    return found


def circles(graph: Mapping[str, set[str]]) -> set[frozenset[str]]:
    """Sets of modules that all import each other, by whatever detour."""
    reached = {module: reached_from(module, graph) for module in graph}
    return {
        frozenset(other for other in reached[module] if module in reached.get(other, ())) | {module}
        for module in graph
        if module in reached[module]
    }


def crowded(paths: Iterable[Path]) -> list[str]:
    """Folders with more files than a reader takes in at a glance."""
    counts = Counter(path.parent.as_posix() for path in paths)
    return [f"{folder} has {count} files" for folder, count in sorted(counts.items()) if count > MOST_FILES]


def body_lines(function: ast.FunctionDef) -> int:
    """Lines of a function from its first statement after the docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return function.end_lineno - body[0].lineno + 1 if body else 0


def long_functions(source: str) -> list[str]:
    functions = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [f"{f.name} has {body_lines(f)} lines" for f in functions if body_lines(f) > LONGEST_BODY]


def test_imports_point_downward():
    assert [wrong for path in files() for wrong in wrong_directions(place_of(path), imports_of(path))] == []


def test_libraries_stay_behind_their_doors():
    assert [wrong for path in files() for wrong in wrong_doors(place_of(path), imports_of(path))] == []


def test_kernels_are_compiled_in_one_way():
    assert {path.parent.name for path in files() if {"numba", "numba.njit"} & {*imports_of(path)}} <= {"_base"}


def test_files_and_functions_fit_on_a_few_screens():
    sources = {place_of(path): path.read_text(encoding="utf-8") for path in files()}
    assert {name for name, source in sources.items() if len(source.splitlines()) > LONGEST_FILE} == set()
    assert {name: found for name, source in sources.items() if (found := long_functions(source))} == {}


def test_every_file_is_in_a_room():
    assert {room(place_of(path)) for path in files()} - set(BELOW) == {"__init__"}


def test_the_only_circles_are_those_named():
    assert circles(module_graph()) == CIRCLES


def test_no_folder_is_crowded():
    tests = [path for path in TESTS.rglob("*.py") if "benchmarks" not in path.relative_to(TESTS).parts]
    assert crowded([*files(), *tests]) == []


def test_the_exceptions_are_still_needed():
    used = {
        (here, there)
        for here, there in UPWARD
        if any(f"{name}.".startswith(f"{there}.") for name in imports_of(ROOT / here))
    }
    assert used == set(UPWARD)


@pytest.mark.parametrize(
    ("place", "source", "complaint"),
    [
        ("mesh/geometry.py", "from simplexmesh.data import volume", "mesh must not import simplexmesh.data.volume"),
        ("mesh/geometry.py", "import simplexmesh", "mesh must not import simplexmesh"),
        ("motion/model/deform.py", "from simplexmesh import Volume", "motion must not import simplexmesh.Volume"),
        ("data/points.py", "def f():\n    from simplexmesh.motion.model.deform import State", "data must not import"),
        ("motion/model/deform.py", "import simplexmesh.plot", "motion must not import simplexmesh.plot"),
        (
            "motion/model/deform.py",
            "from simplexmesh.recognition import sai",
            "motion must not import simplexmesh.recog",
        ),
        ("recognition/sai/match.py", "import simplexmesh.plot", "recognition must not import simplexmesh.plot"),
        ("mesh/shapes.py", "__import__('simplexmesh.plot')", "mesh must not import simplexmesh.plot"),
        ("errors.py", "import simplexmesh._base.checks", "errors must not import simplexmesh._base.checks"),
        ("mesh/shapes.py", "from .duality import dual", "write absolute imports, not .duality.dual"),
    ],
)
def test_a_planted_wrong_direction_is_seen(place, source, complaint):
    (found,) = wrong_directions(place, imports(source))
    assert complaint in found


@pytest.mark.parametrize(
    ("place", "source"),
    [
        ("mesh/geometry.py", "from numba import njit"),
        ("mesh/geometry.py", "def f():\n    import igl"),
        ("motion/model/deform.py", "import pyvista as pv"),
        ("data/volume.py", "import SimpleITK as sitk"),
        ("data/volume.py", "from skimage.measure import marching_cubes"),
        ("data/volume.py", "import matplotlib.pyplot"),
        ("mesh/geometry.py", "from importlib import import_module"),
        ("data/volume.py", "import rich"),
    ],
)
def test_a_planted_library_is_seen(place, source):
    assert len(wrong_doors(place, imports(source))) == 1


def test_right_imports_pass():
    source = (
        "import numpy as np\nfrom simplexmesh._base import checks\nfrom simplexmesh.mesh import geometry\nimport math"
    )
    assert wrong_directions("data/volume.py", imports(source)) == []
    assert wrong_doors("data/volume.py", imports(source)) == []
    assert wrong_doors("mesh/_kernels.py", imports("from numba import njit")) == []


def test_imports_for_type_checkers_are_free():
    assert list(imports("if TYPE_CHECKING:\n    import pyvista\nimport math")) == ["math"]


def test_a_planted_circle_is_seen():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == {frozenset({"b", "c"})}
    assert circles({"a": {"a"}, "b": {"c"}, "c": {"d"}, "d": {"b"}}) == {frozenset("a"), frozenset("bcd")}
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == set()


def test_a_planted_crowd_is_seen():
    assert crowded(Path("room", f"{i}.py") for i in range(MOST_FILES)) == []
    assert crowded(Path("room", f"{i}.py") for i in range(MOST_FILES + 1)) == ["room has 16 files"]


def test_a_planted_long_function_is_seen():
    lines = "".join("    x = 1\n" for _ in range(LONGEST_BODY + 1))
    assert long_functions(f"def f():\n    '''A docstring\n\n    counts not.'''\n{lines}") == ["f has 71 lines"]
    assert long_functions(f"def f():\n    '''A docstring'''\n{lines[10:]}") == []
