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

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh import _check, _vec

REPOSITORY = Path(__file__).parents[1]
HEAVY = {"numba", "scipy", "pyvista", "vtk", "vtkmodules", "skimage", "SimpleITK", "igl", "rich", "typer", "pandas"}
TEXT = {".py", ".md", ".toml", ".sh", ".yml", ".cfg", ".txt", ""}


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

    @pytest.mark.parametrize("name", public())
    def test_every_public_name_is_there(self, name):
        assert getattr(sm, name) is not None
        assert name in dir(sm)

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
    @pytest.mark.parametrize("name", public())
    def test_every_public_name_is_explained(self, name):
        assert len((inspect.getdoc(getattr(sm, name)) or "").split()) > 5

    @pytest.mark.parametrize("name", [n for n in public() if n not in {*sm._SUBMODULES, *sm._HOME["errors"]}])
    def test_every_public_name_has_an_example(self, name):
        assert ">>> " in (getattr(sm, name).__doc__ or "")


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


class TestArray:
    def test_returns_what_was_wanted(self):
        out = _check.array("points", [[0, 1, 2]], (None, 3))
        assert out.dtype == np.float64
        assert out.tolist() == [[0.0, 1.0, 2.0]]

    @pytest.mark.parametrize(
        ("value", "shape", "dtype", "error", "message"),
        [
            (np.zeros(3), (None, 3), float, ValueError, "points must have shape (*, 3), not (3,)"),
            (np.zeros((5, 3)), (4, 3), float, ValueError, "points must have shape (4, 3), not (5, 3)"),
            (np.zeros((2, 2)), (4,), float, ValueError, "points must have shape (4,), not (2, 2)"),
            ([[0, 0, np.nan]], (None, 3), float, ValueError, "points must be finite; points[0, 2] is nan"),
            ([[0, np.inf, 0]], (None, 3), float, ValueError, "points must be finite; points[0, 1] is inf"),
            (np.zeros((2, 3)), (None, 3), int, TypeError, "points must be whole numbers, not float64"),
            ("dragon", (None, 3), float, TypeError, "points must be numbers of shape (*, 3), not str of <U6"),
            (None, (None, 3), float, TypeError, "points must be numbers of shape (*, 3), not NoneType of object"),
            (
                [[1j, 0, 0]],
                (None, 3),
                float,
                TypeError,
                "points must be numbers of shape (*, 3), not list of complex128",
            ),
        ],
    )
    def test_says_what_is_wrong(self, value, shape, dtype, error, message):
        with pytest.raises(error) as caught:
            _check.array("points", value, shape, dtype)
        assert str(caught.value) == message


@pytest.mark.parametrize(
    ("value", "message"),
    [([[0, 1, 99]], "faces[0, 2] is 99, outside 0..2"), ([[0, -1, 1]], "faces[0, 1] is -1, outside 0..2")],
)
def test_indices_say_which_is_outside(value, message):
    with pytest.raises(ValueError, match=r".") as caught:
        _check.indices("faces", value, (None, 3), 3)
    assert str(caught.value) == message


class TestNumber:
    @pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int64(2), np.array(2.0)])
    def test_takes_every_kind_of_number(self, value):
        assert _check.number("level", value, 0) == 2.0

    @pytest.mark.parametrize(
        ("value", "bounds", "error", "message"),
        [
            ("2", {}, TypeError, "level must be a number, not str"),
            (None, {}, TypeError, "level must be a number, not NoneType"),
            (True, {}, TypeError, "level must be a number, not bool"),
            ([1.0], {}, TypeError, "level must be a number, not list"),
            (np.nan, {}, ValueError, "level must be finite, not nan"),
            (-1, {"low": 0}, ValueError, "level must be at least 0, not -1"),
            (0, {"low": 0, "open_low": True}, ValueError, "level must be above 0, not 0"),
            (2, {"low": 0, "high": 1}, ValueError, "level must be between 0 and 1, not 2"),
            (0, {"low": 0, "high": 1, "open_low": True}, ValueError, "level must be above 0 and at most 1, not 0"),
        ],
    )
    def test_says_what_is_wrong(self, value, bounds, error, message):
        with pytest.raises(error) as caught:
            _check.number("level", value, **bounds)
        assert str(caught.value) == message


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        (2, ValueError, "vertices must be at least 4, not 2"),
        (11, ValueError, "vertices must be at most 10, not 11"),
        (5.0, TypeError, "vertices must be a whole number, not float 5.0"),
        (True, TypeError, "vertices must be a whole number, not bool True"),
        ("5", TypeError, "vertices must be a whole number, not str '5'"),
    ],
)
def test_integers_say_what_is_wrong(value, error, message):
    with pytest.raises(error) as caught:
        _check.integer("vertices", value, 4, 10)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        (1.5, TypeError, "rng must be a Generator or a whole number, not float 1.5"),
        (-1, ValueError, "rng must be a Generator or a whole number of at least 0, not -1"),
    ],
)
def test_generators_say_what_is_wrong(value, error, message):
    with pytest.raises(error) as caught:
        _check.generator("rng", value)
    assert str(caught.value) == message


def test_generators_of_one_seed_are_alike_and_a_generator_is_itself():
    rng = _check.generator("rng", 3)
    assert _check.generator("rng", rng) is rng
    assert rng.random() == _check.generator("rng", 3).random()


def test_choices_are_words():
    with pytest.raises(ValueError, match=r"^init must be one of 'auto', 'sphere', not array\(\[0., 0., 0.\]\)$"):
        _check.choice("init", np.zeros(3), ["auto", "sphere"])


def test_choices_are_listed():
    with pytest.raises(ValueError, match=r"^init must be one of 'auto', 'sphere', not 'cube'$"):
        _check.choice("init", "cube", ["auto", "sphere"])


def test_frozen_arrays_are_copies():
    mine = np.zeros(3)
    out = _check.frozen(mine)
    mine[0] = 1
    assert out[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        out[0] = 1


class TestErrors:
    def test_topology_is_a_bad_value(self):
        assert issubclass(sm.TopologyError, ValueError)

    def test_divergence_carries_the_last_mesh(self):
        error = sm.DivergedError("left the finite numbers", mesh="the last")
        assert (str(error), error.mesh) == ("left the finite numbers", "the last")
        assert sm.DivergedError("no mesh").mesh is None


class TestVectors:
    def test_agree_with_numpy(self):
        a, b = np.random.default_rng(0).normal(size=(2, 5, 4, 3))
        np.testing.assert_allclose(_vec.cross(a, b), np.cross(a, b), atol=1e-14)
        np.testing.assert_allclose(_vec.dot(a, b), (a * b).sum(-1), atol=1e-14)
        np.testing.assert_allclose(_vec.norm(a), np.linalg.norm(a, axis=-1), rtol=1e-14)
        np.testing.assert_allclose(_vec.norm(_vec.normalized(a)), 1, rtol=1e-14)


@pytest.mark.parametrize("name", ["mesh", "data", "motion"])
def test_every_room_says_what_it_is(name):
    assert (import_module(f"simplexmesh.{name}").__doc__ or "").startswith("Chapter ")


def test_only_one_class_has_the_name_of_a_public_one():
    homes = {}
    for path in (REPOSITORY / "simplexmesh").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, []).append(path.name)
    public = {name for name in sm.__all__ if inspect.isclass(getattr(sm, name))}
    assert len(public) > 20
    assert {name: homes[name] for name in public if len(homes[name]) > 1} == {}
