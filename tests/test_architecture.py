"""Imports point downward, heavy libraries stay behind their doors; no folder, file or function outgrows a screen."""

from __future__ import annotations

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).parents[1] / "simplexmesh"
TESTS = Path(__file__).parent
ARCHITECTURE = (ROOT.parent / "docs/architecture.md").read_text(encoding="utf-8")

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
    "bench": BASE | {"mesh", "data", "surface", "front"},
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

# Of these, those that close circles: the package below is called back by what is above. Nothing else does.
CIRCLES = {
    ("_base/html.py", "simplexmesh.plot.surface"): "plot.surface draws meshes, whose cards are html",
    ("_base/units.py", "simplexmesh.data.io.writing"): "writing asks for colors, which are named arrays with a unit",
    ("_base/named_arrays.py", "simplexmesh.data.exporting"): "exporting asks for colors, which are named arrays",
    ("mesh/simplex_mesh.py", "simplexmesh.data.triangles"): "triangles show themselves with what draws meshes too",
    ("mesh/simplex_mesh.py", "simplexmesh.surface.curvature.estimate"): "curvature is measured on simplex meshes",
}

# Heavy or special library -> the files that may name it, as patterns; `/` starts at the package.
# NumPy and the standard library are free.
DOORS = {
    "numba": ["_kernels*.py"],
    "igl": ["/mesh/decimation/certified.py", "/motion/targets/triangles.py", "/surface/curvature/classic/principal.py"],
    "skimage": ["/motion/start/solid_mesh.py"],
    "SimpleITK": ["/data/io/itk.py"],
    "plyfile": ["/data/io/ply.py"],
    "laspy": ["/data/io/survey/las.py"],
    "lazrs": ["/data/io/survey/las.py"],
    "pye57": ["/data/io/survey/e57.py"],
    "OCP": ["/cloud/step.py"],
    "pyvista": [
        *("/plot/*.py", "/data/io/vtk.py", "/data/conversion.py", "/data/io/polydata.py"),
        *("/cli/*.py", "/cloud/extraction/result.py", "/data/primitives/curve.py"),
    ],
    "vtkmodules": [
        *("/data/io/vtk.py", "/data/io/polydata.py", "/data/io/obj.py", "/data/io/integrity/apart.py"),
        *("/data/cutting/clipping.py", "/plot/stage.py"),
    ],
    "trame_vtk": ["/plot/stage.py"],
    "trimesh": ["/data/exporting.py"],
    "nibabel": ["/data/exporting.py"],
    "lxml": ["/data/exporting.py"],
    "networkx": ["/data/exporting.py"],
    "open3d": ["/data/exporting.py"],
    "manifold3d": ["/data/cutting/boolean.py"],
    "scipy": ["/*/*.py", "/*/*/*.py", "/*/*/*/*.py"],
    "rich": ["/cli/*.py", "/_base/progress.py"],
    "typer": ["/cli/*.py"],
    "importlib": [  # imports by name hide
        *("/__init__.py", "/_base/html.py", "/mesh/simplex_mesh.py", "/motion/targets/__init__.py"),
    ],
}
FREE = (set(sys.stdlib_module_names) - set(DOORS)) | {"numpy"}

MOST_FILES = 15
LONGEST_FILE = 400
LONGEST_BODY = 70
MOST_PARAMETERS = 8
COMMANDS = {"command", "primitives", "pipes"}
"""Functions of `cli` whose parameters are the options of a command."""

PACKAGES = ("", "motion/targets", "data/primitives", "plot")
"""Folders whose `__init__` makes functions public."""

SAME_DOOR = {"motion/reconstruct/pipeline.py": "simplexmesh.recognition.scans.reconstruct"}
"""Files whose functions another one makes public."""


def files() -> list[Path]:
    return [path for path in sorted(ROOT.rglob("*.py")) if "__pycache__" not in path.parts]


@cache
def nodes_of(source: str) -> list[ast.AST]:
    return list(ast.walk(ast.parse(source)))


def imports(source: str) -> Iterator[str]:
    """Every module or name a source imports, wherever in the file; imports for type checkers only are left out.

    Where an import names what is only known when it runs, these tell what it may be.
    """
    nodes = nodes_of(source)
    by_name = [node.args[0] for node in nodes if isinstance(node, ast.Call) and node.args and is_import(node)]
    unreal = {
        inner
        for node in nodes
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    if not all(isinstance(named, ast.Constant) for named in by_name):
        if not unreal:
            raise ValueError("an import by name without a list for type checkers")
        unreal = set()
    for node in nodes:
        if node in unreal:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{'.' * node.level}{node.module or ''}.{alias.name}" for alias in node.names)
    yield from (str(named.value) for named in by_name if isinstance(named, ast.Constant))


def is_import(call: ast.Call) -> bool:
    called = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    return called in {"import_module", "__import__"}


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
        elif head == "simplexmesh" and place not in ("__init__.py", "__main__.py"):
            above = tail[0] if tail and tail[0] in BELOW else "front"
            if above != room(place) and above not in BELOW.get(room(place), set()) and not is_upward(place, name):
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


def module_of(place: str) -> str:
    """The name of a file as it is imported; that of a package is of its `__init__`."""
    return ".".join(PurePosixPath("simplexmesh", place).with_suffix("").parts).removesuffix(".__init__")


def loaded_with(name: str, module: str, known: Mapping[str, Path]) -> set[str]:
    """The module that an imported name is or is in, and the packages loaded on the way to it from another module."""
    parts = name.split(".")
    on_the_way = [".".join(parts[:k]) for k in range(1, len(parts) + 1)]
    found = [each for each in on_the_way if each in known]
    return {each for each in found if each == found[-1] or not f"{module}.".startswith(f"{each}.")} - {module}


def module_graph(*, upward: bool) -> dict[str, set[str]]:
    """Which of our modules each of them imports, whenever it does, with or without the imports that point up."""
    known = {module_of(place_of(path)): path for path in files()}
    return {
        module: {
            found
            for name in imports_of(path)
            if upward or not is_upward(place_of(path), name)
            for found in loaded_with(name, module, known)
        }
        for module, path in known.items()
    }


def is_upward(place: str, name: str) -> bool:
    return any(place == here and f"{name}.".startswith(f"{there}.") for here, there in UPWARD)


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
    functions = [n for n in nodes_of(source) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [f"{f.name} has {body_lines(f)} lines" for f in functions if body_lines(f) > LONGEST_BODY]


def public_names(place: str) -> set[str]:
    """The public functions and classes of a file, and its commands."""
    imported = [each.rpartition(".") for package in PACKAGES for each in imports_of(ROOT / package / "__init__.py")]
    found = {name for module, _, name in imported if module in {module_of(place), SAME_DOOR.get(place)}}
    return found | (COMMANDS if room(place) == "cli" else set())


def parameter_count(function: ast.FunctionDef) -> int:
    """How many parameters a function has besides the object it is a method of, and the rows that it is a kernel of."""
    given, of_rows = function.args, any("by_rows" in ast.unparse(each) for each in function.decorator_list)
    implied = {"begin", "end"} if of_rows else {"self", "cls"}
    names = {each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs)} - implied
    return len(names) + bool(given.vararg) + bool(given.kwarg)


def wide_functions(source: str, public: Iterable[str] = ()) -> list[str]:
    """The functions of more parameters than a reader holds in mind, but for those of some names or classes."""
    nodes = nodes_of(source)
    doors = [n for n in nodes if isinstance(n, ast.FunctionDef | ast.ClassDef) and n.name in {*public}]
    free = {inner for door in doors for inner in (door, *(door.body if isinstance(door, ast.ClassDef) else ()))}
    functions = [n for n in nodes if isinstance(n, ast.FunctionDef) and n not in free]
    counts = [(f.name, parameter_count(f)) for f in functions]
    return [f"{name} has {count} parameters" for name, count in counts if count > MOST_PARAMETERS]


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
    assert {room(place_of(path)) for path in files()} - set(BELOW) == {"__init__", "__main__"}


def test_only_imports_that_point_up_close_circles():
    assert circles(module_graph(upward=False)) == set()


def test_the_imports_that_close_circles_are_those_named():
    graph = module_graph(upward=True)
    closing = {(here, there) for here, there in UPWARD if module_of(here) in reached_from(there, graph)}
    assert closing == set(CIRCLES)


def test_only_public_doors_are_wide():
    sources = {place_of(path): path.read_text(encoding="utf-8") for path in files()}
    found = {place: wide_functions(source, public_names(place)) for place, source in sources.items()}
    assert {place: wide for place, wide in found.items() if wide} == {}


@pytest.mark.parametrize("folder", ["numerics", "mesh/decimation"])
def test_the_files_of_rooms_that_others_stand_on_are_listed(folder):
    listed = ARCHITECTURE.partition(f"| file of `{folder}` |")[2].partition("\n\n")[0]
    stems = {path.stem for path in files() if path.parent == ROOT / folder} - {"__init__"}
    assert set(re.findall(r"`(\w+)`", " ".join(row.split("|")[1] for row in listed.splitlines()[2:]))) == stems


def test_every_place_that_the_page_sends_to_is_there():
    """Files and folders, from the package or the room that is told of on."""
    there = [f"/{path.relative_to(ROOT.parent).as_posix()}/" for top in (ROOT, TESTS) for path in top.rglob("*")]
    places = set(re.findall(r"`((?:\w+/)+(?:\w+(?:\.py)?)?|\w+\.py)`", ARCHITECTURE))
    assert len(places) > 40
    assert {p for p in places if not any(each.endswith((f"/{p.strip('/')}/", f"/{p}.py/")) for each in there)} == set()


def test_every_name_in_the_page_is_one_of_the_library():
    """Of a file, a folder, or in its code; words of prose do not count."""
    known = {part.removesuffix(".py") for path in [*files(), *TESTS.glob("*")] for part in path.parts}
    for path in files():
        for node in nodes_of(path.read_text(encoding="utf-8")):
            known.update(each for each in vars(node).values() if isinstance(each, str))
    assert set(re.findall(r"`(\w+)`", ARCHITECTURE)) - known == set()


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


def test_imports_run_the_packages_they_come_through():
    known = dict.fromkeys(["simplexmesh", "simplexmesh.a", "simplexmesh.a.b", "simplexmesh.c.d"])
    assert loaded_with("simplexmesh.a.b.f", "simplexmesh.c.d", known) == {"simplexmesh.a", "simplexmesh.a.b"}
    assert loaded_with("simplexmesh.a.b.f", "simplexmesh.a.e", known) == {"simplexmesh.a.b"}
    assert loaded_with("simplexmesh.a.f", "simplexmesh.a.b", known) == {"simplexmesh.a"}


def test_what_is_imported_by_name_is_seen():
    hidden = "import importlib\ndef f(x):\n    return importlib.import_module(f'simplexmesh.{x}')\n"
    with pytest.raises(ValueError, match="without a list"):
        list(imports(hidden))
    assert "simplexmesh.plot" in imports(f"if TYPE_CHECKING:\n    import simplexmesh.plot\n{hidden}")


def test_planted_wide_functions_are_seen():
    names = ", ".join(f"x{i}" for i in range(MOST_PARAMETERS))
    wide = f"def f(self, {names}): ...\nclass A:\n    def g(self, {names}, *, last=0): ...\ndef h({names}, *x): ..."
    assert wide_functions(wide) == ["h has 9 parameters", "g has 9 parameters"]
    assert wide_functions(wide, ["A", "h"]) == []


def test_a_planted_crowd_is_seen():
    assert crowded(Path("room", f"{i}.py") for i in range(MOST_FILES)) == []
    assert crowded(Path("room", f"{i}.py") for i in range(MOST_FILES + 1)) == ["room has 16 files"]


def test_a_planted_long_function_is_seen():
    lines = "".join("    x = 1\n" for _ in range(LONGEST_BODY + 1))
    assert long_functions(f"def f():\n    '''A docstring\n\n    counts not.'''\n{lines}") == ["f has 71 lines"]
    assert long_functions(f"def f():\n    '''A docstring'''\n{lines[10:]}") == []
