"""Run all tests, and write their tables, figures and page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simplexmesh._interrupts import held_interrupts
from simplexmesh.surface.bench import border, noise_errors, peers, pictures, ratings, refinement, tilt
from simplexmesh.surface.bench.curve import Curve
from simplexmesh.surface.bench.page import index
from simplexmesh.surface.bench.pointwise import Pointwise, rows_of, spreads
from simplexmesh.surface.bench.report import INDEX
from simplexmesh.surface.bench.tables import as_csv
from simplexmesh.surface.truth.graphs import Graph

Report = Callable[[float, str], None]
Rows = list[dict[str, Any]]

QUICK_SIZES = (8, 16, 32)
QUICK_AMOUNTS = (0.0, 0.0001, 0.0002)


@dataclass
class Results:
    """Results of the tests."""

    names: Mapping[str, Sequence[str]]
    curves: dict[str, list[Curve]] = field(default_factory=dict)
    meshes: Rows = field(default_factory=list)
    tilts: Rows = field(default_factory=list)
    noise: Rows = field(default_factory=list)
    peers: Rows = field(default_factory=list)
    border: Rows = field(default_factory=list)
    ratings: dict[str, Rows] = field(default_factory=dict)


def measured(
    surfaces: Sequence[Graph], names: Mapping[str, Sequence[str]], report: Report, *, quick: bool = False
) -> Results:
    """Run all tests.

    Parameters
    ----------
    surfaces : sequence of Graph
    names : mapping of kind to methods
    report : function
        Called with the share done and a description of the current step.
    quick : bool
        Smaller meshes, fewer levels of noise, one size of torus; ratings are the same.
    """
    found = Results(names)
    report(0.0, "points")
    test = Pointwise(surfaces)
    found.curves["curvature"] = [curve for name in names["curvature"] for curve in test.curvature(name)]
    found.curves["normals"] = [curve for name in names["normals"] for curve in test.normal(name)]
    report(0.04, "wrong normals")
    found.tilts += tilt.tilt_table(surfaces, names)
    sizes = QUICK_SIZES if quick else refinement.SIZES
    work = sum(size**2 for size in sizes for _ in range(2 * len(surfaces) + 2))
    done = 0
    for surface, kind, size, made in refinement.meshes(surfaces, sizes):
        report(0.05 + 0.4 * done / work, f"{kind} {surface}, {size}")
        place = {"surface": surface, "mesh": kind, "size": size}
        found.meshes += [place | line for line in refinement.mesh_errors(made, names)]
        done += size**2
    for at, (along, cumulative) in enumerate([(a, c) for a in ("normals", "directions") for c in (False, True)]):
        report(0.45 + 0.02 * at, f"noise along {along}")
        amounts, repeats = (QUICK_AMOUNTS, 1) if quick else (noise_errors.AMOUNTS, noise_errors.REPEATS)
        options: dict[str, Any] = {"along": along, "cumulative": cumulative, "amounts": amounts, "repeats": repeats}
        found.noise += noise_errors.noise_table(names["curvature"], **options)
    cases = [case for case in peers.CASES if not quick or (case.size == "2.5k" and case.shape == "torus")]
    for at, case in enumerate(cases):
        report(0.53 + 0.27 * at / len(cases), case.title)
        found.peers += peers.case_errors(case, names)
    report(0.79, "borders")
    found.border += border.border_table(names["curvature"])
    for kind in names:
        found.ratings[kind] = [
            ratings.rated(kind, name, [c for c in found.curves[kind] if c.method == name], found.meshes, found.peers)
            for name in names[kind]
        ]
    return found


def write(found: Results, folder: Path, report: Report, *, quick: bool = False) -> None:
    """Write the tables, figures and page to an existing folder."""
    curves = [*found.curves["curvature"], *found.curves["normals"]]
    tables = {
        "pointwise": rows_of(curves),
        "spread": spreads(curves),
        "meshes": found.meshes,
        "tilts": found.tilts,
        "noise": found.noise,
        "tori": found.peers,
        "border": found.border,
        **{f"ratings_{kind}": rows for kind, rows in found.ratings.items()},
    }
    for name, rows in tables.items():
        (folder / f"{name}.csv").write_text(as_csv(rows), encoding="utf-8")
    shown = list(_pictures(found, quick=quick))
    kept: dict[str, str] = {}
    for at, (name, caption, draw) in enumerate(shown):
        report(0.8 + 0.2 * at / len(shown), f"picture {name}")
        with held_interrupts():
            pictures.save(folder / f"{name}.png", draw())
        kept[name] = caption
    (folder / INDEX).write_text(index(found, kept, quick=quick), encoding="utf-8")


def _pictures(found: Results, *, quick: bool) -> Iterator[pictures.Picture]:
    few = ("cubic",) if quick else None
    for curves in found.curves.values():
        yield from pictures.of_curves(curves, few)
    if not quick:
        yield from pictures.of_sizes(found.meshes, "SplitSquare")
        yield from pictures.of_sizes(found.meshes, "Sawtooth")
    yield from pictures.of_surfaces(found.names, few=quick)
