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
ROWS = CONVENTIONS.partition("| word | meaning |\n|---|---|\n")[2].partition("\n\n")[0]
TABLE = dict(re.findall(r"^\| (.+?) \| (.+) \|$", ROWS, re.MULTILINE))
VOLUMES = {"reconstruct", "register", "sai", "refine", "redistribute"}
VOLUMES_ONLY = {"Isosurface", "LabelSurface", "Volume", "level_lines"}
OTHERWISE = {"boolean", "decimate", "dual", "plot.surface"}  # their first arguments have other names
Function = Callable[..., Any]


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


def words(cell: str) -> list[str]:
    """What a cell of the table names as code."""
    return re.findall(r"`(\w+)`", cell)


def kinds(function: Function) -> dict[str, str]:
    return {key: str(value.annotation) for key, value in parameters(function).items()}


def first_is_named(label: str, name: str, function: Function) -> bool:
    surface, mesh, data, path, cloud, points = words(TABLE[label])
    right = {"Any": {surface, data, cloud, points, "source"}, "SimplexMesh": {mesh}, "str | os.PathLike[str]": {path}}
    first, kind = next(iter(kinds(function).items()), ("", ""))
    return name in METHODS or name in OTHERWISE or first in right.get(kind, {first})


def two_come_first(label: str, name: str, function: Function) -> bool:
    given = list(parameters(function))
    return not {"moving", "fixed"} & {*given} and ("source" not in given or given[:2] == words(label))


def come_together(label: str, name: str, function: Function) -> bool:
    wanted = {*words(label)}
    return name.split(".")[0] in VOLUMES_ONLY or wanted & parameters(function).keys() in (set(), wanted)


def of_type(pattern: str, others: str = "none") -> Callable[[str, str, Function], bool]:
    """The rule that the words of a row have such types wherever they are parameters, and others are not used."""

    def follows(label: str, name: str, function: Function) -> bool:
        given = kinds(function)
        found = [given[word] for word in words(label) if word in given]
        return others not in given and all(re.match(pattern, each) for each in found)

    return follows


def is_a_count(label: str, name: str, function: Function) -> bool:
    return name in METHODS or of_type(r"int\b")(label, name, function)


def is_no_list(label: str, name: str, function: Function) -> bool:
    return not str(inspect.signature(function).return_annotation).startswith("list")


def are_named(label: str, name: str, function: Function) -> bool:
    given = parameters(function).values()
    return all(each.kind is each.KEYWORD_ONLY for each in given if isinstance(each.default, bool))


def is_american(label: str, name: str, function: Function) -> bool:
    return not any(SPELLING.search(key) for key in (name, *parameters(function)))


RULES: dict[str, Callable[[str, str, Function], bool]] = {
    "first argument": first_is_named,
    "`source`, `target`": two_come_first,
    "`vertices`": is_a_count,
    "`at`": of_type(r"ArrayLike|Sequence\[float\]", others="where"),
    "`level`, `label`, `inside`": come_together,
    "`tolerance`, `reach`": of_type(r"float\b"),
    "`angle`": of_type(r"float\b|ArrayLike", others="degrees"),
    "`progress`": of_type(r"bool \| Report$"),
    "`watch`": of_type(r"Callable\["),
    "`rng`": of_type(r"np\.random\.Generator \| int", others="seed"),
    "several results": is_no_list,
    "options": are_named,
    "spelling": is_american,
}


def broken(name: str, function: Function) -> list[str]:
    """The rows of the table that a signature is against."""
    return [label for label, rule in RULES.items() if not rule(label, name, function)]


def result_classes(function: Function) -> set[type]:
    """The classes of this package in the return annotation; each name of a class must be known where it stands."""
    named = set(re.findall(r"(?<![\w.])[A-Z]\w+", str(inspect.signature(function).return_annotation))) - {"None"}
    found = [getattr(inspect.getmodule(function), word) for word in named]
    return {each for each in found if inspect.isclass(each) and each.__module__.startswith("simplexmesh")}


def test_every_row_of_the_table_has_its_rule():
    assert TABLE.keys() == RULES.keys() | {"data"}


def test_every_signature_follows_the_grammar():
    assert {name: rows for name in ALL if (rows := broken(name, ALL[name]))} == {}


def test_results_can_be_imported_and_looked_up():
    homes = {"": sm, "targets.": sm.targets, "primitives.": sm.primitives}
    for kind in set().union(*map(result_classes, ALL.values())):
        assert any(getattr(home, kind.__name__, None) is kind for home in homes.values()), kind
        assert any(f"simplexmesh.{home}{kind.__name__}\n" in API for home in homes), kind


@pytest.mark.parametrize("kind", ["Volume", "PointCloud", "TriangleMesh", "SimplexMesh"])
def test_all_data_is_alike(kind):
    named = words(TABLE["data"])
    assert kind in named
    assert [word for word in named if word.islower() and not hasattr(getattr(sm, kind), word)] == ["mesh"]


@pytest.mark.parametrize("name", sorted(VOLUMES))
def test_what_takes_a_volume_says_which_surface_of_it(name):
    assert {"level", "label", "inside"} <= parameters(FUNCTIONS[name]).keys()


def planted(signature: str) -> Function:
    """A function with such parameters and result."""
    made: dict[str, Function] = {}
    exec(f"from __future__ import annotations\ndef function{signature}: pass", made)
    return made["function"]


@pytest.mark.parametrize(
    ("label", "signature"),
    [
        ("first argument", "(body: Any)"),
        ("first argument", "(surface: SimplexMesh)"),
        ("`source`, `target`", "(source: SAI, best: int, target: SAI)"),
        ("`source`, `target`", "(source: SAI)"),
        ("`vertices`", "(mesh, vertices: ArrayLike)"),
        ("`at`", "(mesh, at: str)"),
        ("`level`, `label`, `inside`", "(data, level: float)"),
        ("`tolerance`, `reach`", "(data, reach: str)"),
        ("`angle`", "(data, degrees: float)"),
        ("`progress`", "(data, progress: bool)"),
        ("`watch`", "(data, watch: bool)"),
        ("`rng`", "(data, seed: int)"),
        ("several results", "(data) -> list[int]"),
        ("options", "(data, fast: bool = True)"),
        ("spelling", "(data, colour: str)"),
    ],
)
def test_a_planted_fault_is_seen_by_its_rule(label, signature):
    assert broken("planted", planted(signature)) == [label]


def test_a_planted_result_of_an_unknown_class_is_seen():
    with pytest.raises(AttributeError):
        result_classes(planted("(data) -> tuple[Unheard, int]"))
