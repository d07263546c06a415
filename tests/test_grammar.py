"""One grammar of the public API: what the table in docs/conventions.md says of names, over all public signatures."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import simplexmesh as sm

API = (Path(__file__).parents[1] / "docs/api.md").read_text(encoding="utf-8")
CONVENTIONS = (Path(__file__).parents[1] / "docs/conventions.md").read_text(encoding="utf-8")
SPELLING = re.compile(r"colour|neighbour|centre|grey|behaviour|(gn|al|an|im|er)ise|isation|labell")
VOLUMES = {"reconstruct", "register", "sai", "refine", "redistribute"}


def unwrapped(member: Any) -> Any:
    """The function behind a method."""
    return member.__func__ if isinstance(member, staticmethod | classmethod) else member


def functions() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Every public function, by its name in the package."""
    for room, prefix in ((sm, ""), (sm.plot, "plot.")):
        for name in room.__all__:
            found = getattr(room, name)
            if inspect.isfunction(found):
                yield prefix + name, found


def methods() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Every public method, and what makes an object, by class and name."""
    classes = [getattr(sm, name) for name in sm.__all__] + [getattr(sm.targets, name) for name in sm.targets.__all__]
    for kind in classes:
        if inspect.isclass(kind):
            for name, member in vars(kind).items():
                method = isinstance(member, staticmethod | classmethod) or inspect.isfunction(member)
                if method and not name.startswith("_"):
                    yield f"{kind.__name__}.{name}", unwrapped(member)


FUNCTIONS, METHODS = dict(functions()), dict(methods())
ALL = FUNCTIONS | METHODS


def parameters(function: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    return {k: v for k, v in inspect.signature(function).parameters.items() if k not in ("self", "cls")}


def complaints(name: str, function: Callable[..., Any]) -> list[str]:
    """What in a signature is against the grammar."""
    given = parameters(function)
    kinds = {key: str(value.annotation) for key, value in given.items()}
    found = [f"{key} is not spelled as in American English" for key in given if SPELLING.search(key)]
    if name in FUNCTIONS and not re.match(r"int\b", kinds.get("vertices", "int")):
        found.append("vertices is a count, a selection is at")
    if ("source" in given) != ("target" in given) and "source" in given:
        found.append("source and target come together")
    if "source" in given and list(given)[:2] != ["source", "target"]:
        found.append("source and target come first")
    found += [f"{key} should be source or target" for key in ("moving", "fixed", "reference_surface") if key in given]
    volumes = {"level", "label", "inside"} & given.keys()
    if (
        volumes
        and len(volumes) < 3
        and name.split(".")[0] not in ("Isosurface", "LabelSurface", "Volume", "level_lines")
    ):
        found.append("level, label and inside come together")
    if "progress" in given and kinds["progress"] != "bool | Report":
        found.append("progress is true, false or a function of a share and a message")
    if "watch" in given and "Callable" not in kinds["watch"]:
        found.append("watch is a function of states")
    if "tolerance" in given and not re.match(r"float\b", kinds["tolerance"]):
        found.append("tolerance is a length")
    if "degrees" in given:
        found.append("angles are in radians")
    if re.match(r"list\b", str(inspect.signature(function).return_annotation)):
        found.append("tuples are returned, not lists")
    for key, value in given.items():
        if isinstance(value.default, bool) and value.kind is not inspect.Parameter.KEYWORD_ONLY:
            found.append(f"{key} must be named")
    return found


def result_classes(function: Callable[..., Any]) -> set[type]:
    """The classes of this package in the return annotation."""
    words = re.findall(r"\b[A-Z]\w+", str(inspect.signature(function).return_annotation))
    found = [getattr(inspect.getmodule(function), word, None) for word in words]
    return {each for each in found if inspect.isclass(each) and each.__module__.startswith("simplexmesh")}


@pytest.mark.parametrize("name", ALL)
def test_a_signature_follows_the_grammar(name):
    assert complaints(name, ALL[name]) == []


@pytest.mark.parametrize("name", ALL)
def test_results_can_be_imported_and_looked_up(name):
    for kind in result_classes(ALL[name]):
        assert getattr(sm, kind.__name__, None) is kind or getattr(sm.targets, kind.__name__, None) is kind
        assert f"simplexmesh.{kind.__name__}\n" in API or f"simplexmesh.targets.{kind.__name__}\n" in API


@pytest.mark.parametrize("name", [name for name in sm.__all__ if name not in {"__version__", "plot", "targets"}])
def test_every_public_name_is_in_the_reference(name):
    assert f"simplexmesh.{name}\n" in API


@pytest.mark.parametrize("kind", ["Volume", "PointCloud", "TriangleMesh", "SimplexMesh"])
@pytest.mark.parametrize("member", ["save", "to_pyvista", "transformed", "bounds", "diagonal"])
def test_all_data_has(kind, member):
    assert hasattr(getattr(sm, kind), member)
    assert f"`{member}`" in CONVENTIONS


@pytest.mark.parametrize("name", sorted(VOLUMES))
def test_what_takes_a_volume_says_which_surface_of_it(name):
    assert {"level", "label", "inside"} <= parameters(FUNCTIONS[name]).keys()


def test_planted_faults_are_seen():
    def wrong(moving, vertices: list[float], colour=True, *, source=None, level=None, tolerance: str = "") -> list[int]:
        raise NotImplementedError

    FUNCTIONS["wrong"] = wrong
    try:
        assert len(complaints("wrong", wrong)) == 9
    finally:
        del FUNCTIONS["wrong"]
    assert complaints("register", sm.register) == []
