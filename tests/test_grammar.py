"""One grammar of the public API: what the table in docs/conventions.md says of names, over all public signatures."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simplexmesh as sm
from simplexmesh.surface.curvature import estimate as curvatures
from simplexmesh.surface.normals import estimate as normals

API = (Path(__file__).parents[1] / "docs/api.md").read_text(encoding="utf-8")
CONVENTIONS = (Path(__file__).parents[1] / "docs/conventions.md").read_text(encoding="utf-8")
SPELLING = re.compile(r"colour|neighbour|centre|grey|behaviour|(gn|al|an|im|er)ise|isation|labell")


def table(*head: str) -> list[list[str]]:
    """The cells of the rows of the table under such a head."""
    rows = CONVENTIONS.partition(f"| {' | '.join(head)} |\n|{'---|' * len(head)}\n")[2].partition("\n\n")[0]
    return [[cell.strip() for cell in row.strip("|").split(" | ")] for row in rows.splitlines()]


def words(cell: str) -> list[str]:
    """What a cell of a table names as code."""
    return re.findall(r"`(.+?)`", cell)


TABLE = dict(table("word", "meaning"))
FIRST = {
    (word, kind)
    for names, kinds, _ in table("first argument", "in signatures", "meaning")
    for word in words(names)
    for kind in words(kinds)
}
SIZES = {
    (word, name)
    for sizes, names, _, _ in table("size", "of", "meaning", "unit")
    for word in words(sizes)
    for name in words(names)
}
SIZE = re.compile(
    r"tolerance|reach|distance|radius|gap|scale|noise|threshold|minimum|limit|longest|^edge$|slack|penetration|tunnels|"
    r"sigma|inner|pace|accuracy|difference|detail"
)
"""What sizes are called."""

METHODS_OF = {"curvature": curvatures.METHODS, "vertex_normals": normals.METHODS}
"""Methods whose options are given by name."""

VOLUMES_ONLY = {"Isosurface", "LabelSurface", "Volume", "level_lines"}
POSITIONS = {"moved", "gap", "prescribe"}
"""Methods whose `vertices` are positions, as those of constructors are."""

Function = Callable[..., Any]


def functions() -> Iterator[tuple[str, Function]]:
    """Every public function, by its name in the package."""
    for room, prefix in ((sm, ""), (sm.plot, "plot.")):
        for name in room.__all__:
            found = getattr(room, name)
            if inspect.isfunction(found):
                yield prefix + name, found


def methods() -> Iterator[tuple[str, Function]]:
    """Every public class, and its methods, inherited ones too, by class and name."""
    for room in (sm, sm.targets, sm.primitives):
        for kind in (found for name in room.__all__ if inspect.isclass(found := getattr(room, name))):
            if not issubclass(kind, Exception):
                yield kind.__name__, kind
                for name, member in inspect.getmembers(
                    kind, lambda each: inspect.isfunction(each) or inspect.ismethod(each)
                ):
                    if not name.startswith("_"):
                        yield f"{kind.__name__}.{name}", member


FUNCTIONS, METHODS = dict(functions()), dict(methods())
ALL = FUNCTIONS | METHODS


def parameters(function: Function) -> dict[str, inspect.Parameter]:
    return {k: v for k, v in inspect.signature(function).parameters.items() if k not in ("self", "cls")}


def kinds(function: Function) -> dict[str, str]:
    return {key: str(value.annotation) for key, value in parameters(function).items()}


def first_is_named(label: str, name: str, function: Function) -> bool:
    given = [(k, str(v.annotation)) for k, v in parameters(function).items() if v.kind < v.VAR_KEYWORD]
    first, kind = given[0] if given else ("", "")
    parts = {*kind.split(" | ")}
    things = {each for _, each in FIRST} - {"str"}
    return not parts & things or all((first, each) in FIRST for each in parts)


def two_come_first(label: str, name: str, function: Function) -> bool:
    given = list(parameters(function))
    moves = {key for key in given if key.startswith("T_")} <= {"T_target_source", "T_pairs"}
    return moves and not {"moving", "fixed"} & {*given} and ("source" not in given or given[:2] == words(label))


def come_together(label: str, name: str, function: Function) -> bool:
    wanted = {*words(label)}
    return name.split(".")[0] in VOLUMES_ONLY or wanted & parameters(function).keys() in (set(), wanted)


def of_type(pattern: str, *others: str) -> Callable[[str, str, Function], bool]:
    """The rule that the words of a row have such types wherever they are parameters, and others are not used."""

    def follows(label: str, name: str, function: Function) -> bool:
        given = kinds(function)
        found = [given[word] for word in words(label) if word in given]
        return (inspect.isclass(function) or not {*others} & given.keys()) and all(
            re.match(pattern, each) for each in found
        )

    return follows


def are_counted(label: str, name: str, function: Function) -> bool:
    positions = inspect.isclass(function) or name.rpartition(".")[2] in POSITIONS
    return positions or of_type(r"int\b")(label, name, function)


def is_no_list(label: str, name: str, function: Function) -> bool:
    return not str(inspect.signature(function).return_annotation).startswith("list")


def are_named(label: str, name: str, function: Function) -> bool:
    given = () if inspect.isclass(function) else parameters(function).values()
    return all(each.kind is each.KEYWORD_ONLY for each in given if isinstance(each.default, bool))


def are_words(label: str, name: str, function: Function) -> bool:
    return all(len(key) > 1 for key in parameters(function))


def is_american(label: str, name: str, function: Function) -> bool:
    return not any(SPELLING.search(key) for key in (name, *parameters(function)))


RULES: dict[str, Callable[[str, str, Function], bool]] = {
    "`source`, `target`": two_come_first,
    "`vertices`": are_counted,
    "`count`": of_type(r"int\b"),
    "`at`": of_type(r"ArrayLike|Sequence\[float\]|Indices", "where", "picked", "rows"),
    "`level`, `label`, `inside`": come_together,
    "`tolerance`, `reach`": of_type(r"float\b"),
    "`angle`": of_type(r"float\b|Array", "degrees"),
    "`progress`": of_type(r"bool \| Progress$"),
    "`watch`": of_type(r"Callable\["),
    "`rng`": of_type(r"np\.random\.Generator \| int", "seed"),
    "several results": is_no_list,
    "options": are_named,
    "names": are_words,
    "spelling": is_american,
}


def broken(name: str, function: Function) -> list[str]:
    """The rows of the tables that a signature is against."""
    rules = {"first argument": first_is_named, **RULES}
    return [label for label, rule in rules.items() if not rule(label, name, function)]


HOMES = {"": sm, "targets.": sm.targets, "primitives.": sm.primitives}


def named_classes(annotation: Any, module: str) -> set[type]:
    """The classes of this package that an annotation names; each must be known in its module, or public."""
    words = set(re.findall(r"(?<![\w.])[A-Z]\w+", str(annotation))) - {"None"}
    places = [sys.modules.get(module), *HOMES.values()]
    found = [next(getattr(place, word) for place in places if hasattr(place, word)) for word in words]
    return {each for each in found if inspect.isclass(each) and each.__module__.startswith("simplexmesh")}


def result_classes(function: Function) -> set[type]:
    """The classes of this package that a function returns, or that the public attributes of a class hold."""
    if not inspect.isclass(function):
        return named_classes(inspect.signature(function).return_annotation, function.__module__)
    made = [each for _, each in inspect.getmembers_static(function) if isinstance(each, property | cached_property)]
    getters = [getattr(each, "fget", None) or each.func for each in made]
    of_properties = [result_classes(each) for each in getters if not each.__name__.startswith("_")]
    of_fields = [
        named_classes(annotation, base.__module__)
        for base in function.__mro__
        for name, annotation in vars(base).get("__annotations__", {}).items()
        if not name.startswith("_")
    ]
    return set().union(*of_properties, *of_fields)


def test_every_row_of_the_table_has_its_rule():
    assert TABLE.keys() == RULES.keys() | {"data"}


def sizes(name: str, function: Function) -> set[tuple[str, str]]:
    """The parameters of a function that are sizes, by its own name; what results hold is no choice of a caller."""
    result = inspect.isclass(function) and name != "DeformableModel"
    named = {} if result else kinds(function)
    number = re.compile(r"(str \| |Sequence\[)?float\b")
    keys = {key for key, kind in named.items() if SIZE.search(key) and number.match(kind)}
    options = {key for method in METHODS_OF.get(name, {}).values() for key in method.options if SIZE.search(key)}
    return {(key, name.split(".")[-1]) for key in keys | options}


def test_the_unit_of_every_size_is_told():
    assert set().union(*(sizes(name, function) for name, function in ALL.items())) == SIZES


def test_a_planted_size_is_seen():
    found = sizes(
        "planted", planted("(surface: Any, edges: bool, distance: float | None, tolerance_k: str | float = 0)")
    )
    assert found == {("distance", "planted"), ("tolerance_k", "planted")}


def test_every_row_of_first_arguments_is_used():
    used = {(word, part) for f in ALL.values() for word, kind in kinds(f).items() for part in kind.split(" | ")}
    assert used >= FIRST


def test_every_signature_follows_the_grammar():
    assert {name: rows for name in ALL if (rows := broken(name, ALL[name]))} == {}


def test_results_can_be_imported_and_looked_up():
    for kind in set().union(*map(result_classes, ALL.values())):
        assert any(getattr(home, kind.__name__, None) is kind for home in HOMES.values()), kind
        assert any(f"simplexmesh.{home}{kind.__name__}\n" in API for home in HOMES), kind


@pytest.mark.parametrize("kind", ["Volume", "PointCloud", "TriangleMesh", "SimplexMesh"])
def test_all_data_is_alike(kind):
    named = words(TABLE["data"])
    assert kind in named
    assert [word for word in named if word.islower() and not hasattr(getattr(sm, kind), word)] == ["mesh"]


BALL = sm.sphere(4, radius=4, center=(5.5, 5.5, 5.5))
SHAPE = sm.Volume((np.hypot(*np.mgrid[:12, :12, :12][:2] - 5.5) < 4).astype(np.uint8))
OTHERS: dict[str, Any] = {
    "surface": BALL, "data": BALL, "cloud": BALL.vertices, "points": BALL.vertices, "source": BALL, "target": BALL,
    "mesh": BALL, "first": BALL, "second": BALL, "origin": (0, 0, 0), "normal": (0, 0, 1), "values": np.zeros(320),
    "pairs": (BALL.vertices[:9], BALL.vertices[:9]), "T_target_source": np.eye(4), "kind": "plane", "tolerance": 0.1,
    "labels": np.zeros(320, int), "landmarks": np.eye(3), "targets": np.eye(3), "pick": (0, 0, 0), "radius": 1.0,
    "path": "x.ply", "found": (), "scans": [BALL, BALL], "things": {"one": BALL}, "triangles": BALL.triangulated(),
    "volume": SHAPE, "level": 0.5,
}  # fmt: skip
"""What functions are given besides a volume."""
NOT_DATA = {"labels", "poses", "curve", "marks", "lines", "found", "targets", "what", "options"}
"""Parameters of any type that are no data."""


def needed(name: str) -> dict[str, Any]:
    """Arguments of a function without a volume."""
    given = parameters(ALL[name])
    found = {k: OTHERS[k] for k, v in given.items() if v.default is v.empty and v.kind < v.VAR_KEYWORD}
    return found | ({"vertices": 100} if name == "decimate" else {})


def takers() -> Iterator[tuple[str, str]]:
    """Every public function, or target, and a parameter of it that is data of any kind."""
    for name, function in ALL.items():
        if name in FUNCTIONS or inspect.isclass(function):
            for key, kind in kinds(function).items():
                if (
                    re.match(r"(Sequence\[|Mapping\[str, )?Any\b", kind)
                    and key not in NOT_DATA
                    and not key.startswith("_")
                ):
                    yield name, key


@pytest.mark.parametrize(("name", "key"), list(takers()))
def test_what_takes_a_volume_says_which_surface_of_it_and_others_refuse_it(name, key):
    given = parameters(ALL[name])
    if name.split(".")[0] in VOLUMES_ONLY or {"level", "label", "inside"} <= given.keys() or name == "save":
        return
    kind = str(given[key].annotation)
    volumes = (
        {"one": SHAPE, "other": SHAPE} if kind.startswith("Mapping") else [SHAPE] * 2 if "Sequence" in kind else SHAPE
    )
    with pytest.raises(TypeError, match=r"Volume.*reconstruct"):
        ALL[name](**needed(name) | {key: volumes})


@pytest.mark.parametrize(
    "chosen", [{"level": 0.5}, {"label": 1}, {"inside": "below"}], ids=lambda chosen: next(iter(chosen))
)
@pytest.mark.parametrize(
    "name", [name for name in FUNCTIONS if {"level", "label", "inside"} <= parameters(ALL[name]).keys()]
)
def test_what_chooses_a_surface_of_a_volume_is_refused_where_there_is_none(name, chosen):
    with pytest.raises(ValueError, match="volume"):
        ALL[name](**needed(name), **chosen)


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
        ("`source`, `target`", "(name: str, T_scan_model: Array)"),
        ("first argument", "(path: str | SimplexMesh)"),
        ("`vertices`", "(mesh, vertices: ArrayLike)"),
        ("`count`", "(mesh, count: float)"),
        ("`at`", "(mesh, at: str)"),
        ("`at`", "(mesh, rows: ArrayLike)"),
        ("`level`, `label`, `inside`", "(data, level: float)"),
        ("`tolerance`, `reach`", "(data, reach: str)"),
        ("`angle`", "(data, degrees: float)"),
        ("`progress`", "(data, progress: bool)"),
        ("`watch`", "(data, watch: bool)"),
        ("`rng`", "(data, seed: int)"),
        ("several results", "(data) -> list[int]"),
        ("options", "(data, fast: bool = True)"),
        ("names", "(mesh, n: int)"),
        ("spelling", "(data, colour: str)"),
    ],
)
def test_a_planted_fault_is_seen_by_its_rule(label, signature):
    assert broken("planted", planted(signature)) == [label]


def test_a_planted_result_of_an_unknown_class_is_seen():
    with pytest.raises(StopIteration):
        result_classes(planted("(data) -> tuple[Unheard, int]"))


def test_planted_attributes_are_seen():
    class Result:
        one: Volume | None  # noqa: F821
        _other: Unheard  # noqa: F821

        @property
        def many(self) -> tuple[PointCloud, ...]: ...  # noqa: F821

        @cached_property
        def last(self) -> SAI: ...  # noqa: F821

    assert result_classes(Result) == {sm.Volume, sm.PointCloud, sm.SAI}
