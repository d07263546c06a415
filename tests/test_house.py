"""The house: what importing costs, that every public name is there and documented, that messages read well."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
import tomllib
from importlib import import_module, metadata
from pathlib import Path

import pytest

import simplexmesh as sm

REPOSITORY = Path(__file__).parents[1]
HEAVY = {"numba", "scipy", "pyvista", "vtk", "vtkmodules", "skimage", "SimpleITK", "igl", "rich", "typer", "pandas"}
TEXT = {".py", ".md", ".toml", ".sh", ".yml", ".cfg", ".txt", ""}


RESULTS = {  # shown by the examples of what returns them
    *("Edited", "Batch", "Cut", "Joined", "Seam", "Regularized", "State", "Refined", "Round", "Opened", "Handled"),
    *("HandleProposal", "Distance", "Rings", "Ball", "Nearest", "StartReport", "TopologyRecord", "Topology"),
    *("Chain", "Feet", "Validation"),
}


def loaded_after(statement: str) -> set[str]:
    """Top-level packages in a fresh interpreter after a statement."""
    code = f"import sys\n{statement}\nprint(*sorted({{name.partition('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def public() -> list[str]:
    return [name for name in sm.__all__ if name != "__version__"]


class TestImport:
    def test_costs_nothing(self):
        assert loaded_after("import simplexmesh") & (HEAVY | {"numpy"}) == set()

    def test_of_a_name_loads_only_its_own(self):
        assert loaded_after("import simplexmesh as sm; sm.Volume") & (HEAVY - {"scipy"}) == set()

    def test_the_probe_sees_a_heavy_import(self):
        assert "numba" in loaded_after("import numba")

    def test_every_public_name_is_there(self):
        assert {*public()} <= {*dir(sm)}
        assert [name for name in public() if getattr(sm, name) is None] == []

    def test_an_unknown_name_is_refused(self):
        with pytest.raises(AttributeError, match=r"^module 'simplexmesh' has no attribute 'colour'$"):
            sm.colour  # noqa: B018

    def test_type_checkers_see_the_same_names(self):
        tree = ast.parse((REPOSITORY / "simplexmesh/__init__.py").read_text(encoding="utf-8"))
        (block,) = (n for n in tree.body if isinstance(n, ast.If))
        seen = {alias.name: node.module for node in block.body for alias in node.names}
        for name in public():
            home = getattr(sm, name)
            expected = getattr(home, "__module__", None) or home.__name__.rpartition(".")[0]
            assert seen.pop(name) == expected
        assert seen == {}


class TestDocumentation:
    def test_every_public_name_is_explained(self):
        texts = {name: inspect.getdoc(getattr(sm, name)) or "" for name in public()}
        assert [name for name, text in texts.items() if len(text.split()) <= 5] == []

    def test_every_public_name_has_an_example(self):
        wanted = {*public()} - {*sm._SUBMODULES, *sm._HOME["_base.errors"]} - RESULTS
        assert [name for name in sorted(wanted) if ">>> " not in (getattr(sm, name).__doc__ or "")] == []


class TestSingleSource:
    def test_of_the_version(self):
        project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        assert "version" in project["dynamic"]
        assert re.fullmatch(r"\d+\.\d+\.\d+", sm.__version__)
        assert metadata.version("simplexmesh") == sm.__version__

    def test_the_changelog_knows_the_version(self):
        assert f"## {sm.__version__}" in (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8")

    def test_no_file_names_a_machine(self):
        listed = subprocess.run(["git", "ls-files"], cwd=REPOSITORY, capture_output=True, text=True, check=False)
        if listed.returncode:
            pytest.skip("not a checkout")
        machine = re.compile(r"(?<![\w.])/(" + "|".join(["work", "home", "root", "tmp", "Users"]) + r")/\w")
        found = [
            f"{name}:{number}: {line.strip()}"
            for name in listed.stdout.split("\n")
            if name and Path(name).suffix in TEXT and (REPOSITORY / name).is_file()
            for number, line in enumerate((REPOSITORY / name).read_text(encoding="utf-8").splitlines(), 1)
            if machine.search(line)
        ]
        assert found == []


class TestErrors:
    def test_topology_is_a_bad_value(self):
        assert issubclass(sm.TopologyError, ValueError)

    def test_divergence_carries_the_last_mesh(self):
        error = sm.DivergedError("left the finite numbers", mesh="the last")
        assert (str(error), error.mesh) == ("left the finite numbers", "the last")
        assert sm.DivergedError("no mesh").mesh is None


@pytest.mark.parametrize("name", ["mesh", "data", "motion"])
def test_every_room_says_what_it_is(name):
    assert (import_module(f"simplexmesh.{name}").__doc__ or "").startswith("Chapter ")


def named_types(source: str) -> set[str]:
    """The classes that a source defines, and the aliases of types; not its type variables."""
    aliases = re.findall(r"^([A-Z]\w*[a-z]\w*)(?:: TypeAlias)? = (?!TypeVar|ParamSpec)", source, re.MULTILINE)
    return {*aliases, *re.findall(r"^\s*class (\w+)", source, re.MULTILINE)}


def homes() -> dict[str, list[str]]:
    """The files that define a type, for every name of one."""
    found: dict[str, list[str]] = {}
    for path in sorted((REPOSITORY / "simplexmesh").rglob("*.py")):
        for name in named_types(path.read_text(encoding="utf-8")):
            found.setdefault(name, []).append(path.relative_to(REPOSITORY / "simplexmesh").as_posix())
    return found


def test_only_one_type_has_the_name_of_a_public_one():
    public = {
        name
        for room in (sm, sm.targets, sm.primitives)
        for name in room.__all__
        if inspect.isclass(getattr(room, name))
    }
    assert len(public) > 40
    assert {name: where for name, where in homes().items() if name in public and len(where) > 1} == {}


def test_only_one_type_of_a_room_has_its_name():
    rooms = {name: [place.partition("/")[0] for place in where] for name, where in homes().items()}
    assert {name: homes()[name] for name, each in rooms.items() if len(each) > len({*each})} == {}


def test_a_planted_type_is_seen():
    source = "class Report(NamedTuple):\n    x: int\nFit = tuple[int, int]\nMOST = 3\nSelf = TypeVar('Self')\n"
    assert named_types(source) == {"Report", "Fit"}
