"""Fourth test: errors under increasing noise (Charton, Gueorguieva, Desbarats 2012, tables 10 and 11)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from simplexmesh.surface.bench.candidates import RefusedError, curvature_of
from simplexmesh.surface.samples import Samples
from simplexmesh.surface.truth.discretized import split_square
from simplexmesh.surface.truth.graphs import graph
from simplexmesh.surface.truth.noise import noise_levels

AMOUNTS = tuple(round(0.0001 * step, 4) for step in range(15))
"""Total widths of uniform noise, in diagonals of the bounding box."""

SQUARES = 50
"""Squares per side of the grid of the article's row without noise, on the cap z = sqrt(4 - x^2 - y^2)."""

REPEATS = 4

VORONOI = "discrete, Voronoi cells"
"""The article divides by the Voronoi cell even at obtuse triangles."""


def noise_table(
    names: Sequence[str],
    *,
    along: str,
    cumulative: bool,
    amounts: Sequence[float] = AMOUNTS,
    repeats: int = REPEATS,
    rng: int = 0,
) -> Iterator[dict[str, object]]:
    """Yield for each amount and method the mean and the standard deviation of |error| of H and K at inner vertices.

    Parameters
    ----------
    names : sequence of str
        Methods of `curvature`, with area-weighted initial normals.
    along : {"normals", "directions"}
        Direction of the noise: table 10, or 11.
    cumulative : bool
        Whether to add each level's noise to the level before, to reproduce the article's numbers.
    amounts : sequence of float
    repeats : int
        Number of realizations averaged.
    rng : int
        Seed.
    """
    made = split_square(graph("sphere"), SQUARES)
    options = {"along": along, "cumulative": cumulative, "unit": "diagonal", "distribution": "uniform"}
    runs = [list(noise_levels(made.mesh, amounts, rng=rng + k, **options)) for k in range(repeats)]  # type: ignore[arg-type]
    for level, amount in enumerate(amounts):
        for name, method, asked in _entries(names):
            errors: dict[str, list[np.ndarray]] = {"H": [], "K": []}
            for run in runs:
                mesh = run[level]
                try:
                    found = curvature_of(method, Samples(mesh.vertices, mesh.faces), options=asked)
                except RefusedError:
                    continue
                errors["H"].append(np.abs(found.mean - made.exact.mean)[made.scored])
                errors["K"].append(np.abs(found.gauss - made.exact.gauss)[made.scored])
            for quantity, found_errors in errors.items():
                if found_errors:
                    known = np.concatenate(found_errors)
                    known = known[np.isfinite(known)]
                    line = {"along": along, "cumulative": cumulative, "amount": amount, "method": name}
                    yield line | {"quantity": quantity, "mean": known.mean(), "spread": known.std()}


def _entries(names: Sequence[str]) -> list[tuple[str, str, dict[str, str]]]:
    """Return (name, method, options): every method with its defaults, and the discrete one as in the article."""
    entries: list[tuple[str, str, dict[str, str]]] = [(name, name, {}) for name in names]
    if "discrete" in names:
        entries.append((VORONOI, "discrete", {"area": "voronoi"}))
    return entries
