"""Run all trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from simplexmesh._base.progress import Progress
from simplexmesh.bench.trials import meshes, ratings
from simplexmesh.bench.trials.curve import Curve
from simplexmesh.bench.trials.pointwise import Pointwise, tilts
from simplexmesh.bench.truth.graphs import Graph


@dataclass
class Results:
    """Results of the trials, a row per case."""

    names: Mapping[str, Sequence[str]]
    curves: dict[str, list[Curve]] = field(default_factory=dict)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    tilts: list[dict[str, Any]] = field(default_factory=list)
    tori: list[dict[str, Any]] = field(default_factory=list)
    border: list[dict[str, Any]] = field(default_factory=list)
    ratings: dict[str, list[dict[str, Any]]] = field(default_factory=dict)


def measured(
    surfaces: Sequence[Graph], names: Mapping[str, Sequence[str]], report: Progress, *, quick: bool = False
) -> Results:
    """Run all trials; a quick run has smaller meshes and one size of torus, and the same ratings."""
    found = Results(names)
    report(0.0, "points")
    test = Pointwise(surfaces)
    found.curves = {kind: [curve for name in names[kind] for curve in test.curves(kind, name)] for kind in names}
    found.tilts += tilts(surfaces, names)
    sizes = meshes.SIZES[:3] if quick else meshes.SIZES
    work, done = sum(size**2 for size in sizes) * (2 * len(surfaces) + 2), 0
    for place, made in meshes.refined(surfaces, sizes):
        report(0.05 + 0.45 * done / work, f"{place['mesh']} {place['surface']}, {place['size']}")
        found.meshes += [place | line for line in meshes.mesh_errors(made, names)]
        done += place["size"] ** 2
    cases = [case for case in meshes.CASES if not quick or (case.size == "2.5k" and case.shape == "torus")]
    for at, case in enumerate(cases):
        report(0.5 + 0.29 * at / len(cases), case.title)
        found.tori += meshes.case_errors(case, names)
    report(0.79, "borders")
    found.border += meshes.border_errors(names)
    for kind in names:
        found.ratings[kind] = [
            ratings.rated(kind, name, [c for c in found.curves[kind] if c.method == name], found.meshes)
            for name in names[kind]
        ]
    return found
