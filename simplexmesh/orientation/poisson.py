"""Globally consistent orientation of point normals by iterated Poisson reconstruction.

Consistently oriented normals are the gradient of an indicator function; where some are flipped they cancel. So the
indicator of the current normals tells which to flip, repeatedly, and its energy tells which of several initializations
converged best (F. Hou, C. Wang, W. Wang, H. Qin, C. Qian, Y. He, Iterative Poisson surface reconstruction for
unoriented points, ACM Trans. Graph. 41, 2022; there from random normals, without the energy criterion).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._base.vectors import dot
from simplexmesh.numerics.plane_fits import Planes
from simplexmesh.orientation.flood import Flood, flooded
from simplexmesh.orientation.indicator import Indicator, Poisson

Array = NDArray[np.float64]

FLOOD_CELLS = (16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Cells along the longest side of the grids that are flooded."""


@dataclass(frozen=True, eq=False)
class Fixpoint:
    """Converged normals, their energy, the number of iterations, and their indicator if none was flipped last."""

    normals: Array
    energy: float
    iterations: int
    field: Indicator | None


def fixpoint(problem: Poisson, normals: Array) -> Fixpoint:
    """Flip normals that contradict their indicator until hardly any do."""
    for iterations in range(1, 9):  # noqa: B007
        field = problem.indicator(normals)
        slope = dot(normals, field.at(problem.points)[1])
        energy = -float((problem.areas * slope).sum())
        wrong = slope > 0
        normals = np.where(wrong[:, None], -normals, normals)
        if np.count_nonzero(wrong) < 1e-3 * len(normals):
            break
    return Fixpoint(normals, energy, iterations, None if wrong.any() else field)


def oriented_indicator(points: Array, found: Planes, cell: float) -> Indicator:
    """Return the indicator function, with cells of side `cell`, of the solid that points with unoriented normals bound.

    The first initialization comes from the finest flood that does not leak. Unless it converges at once, others are
    tried: the next best flood, and normals pointing away from the centroid, iterated on a coarse grid first, where
    holes in the data close. The one whose indicator has the largest energy on cells of twice the size is continued on
    the requested grid.
    """
    coarse = Poisson.of(points, 2 * cell)
    tried: list[Fixpoint] = []
    for normals in _initial_normals(points, found, cell):
        tried.append(fixpoint(coarse, normals))
        if tried[0].iterations == 1:
            break
    fine = Poisson.of(points, cell)
    last = fixpoint(fine, max(tried, key=lambda each: each.energy).normals)
    return last.field or fine.indicator(last.normals)


def _initial_normals(points: Array, found: Planes, cell: float) -> Iterator[Array]:
    """Yield candidate orientations of the normals, the most likely first."""
    floods = sorted(_floods(points, found.spacing), key=lambda flood: -flood.enclosed)
    yield (flooding := _opposed_to(found.normals, _inward(floods[0], points)))
    if len(floods) > 1:
        yield _opposed_to(found.normals, _inward(floods[1], points))
    coarse = float(np.ptp(points, axis=0).max()) / 32
    radial = _opposed_to(found.normals, points.mean(axis=0) - points)
    if coarse > 2.5 * cell:
        problem = Poisson.of(points, coarse)
        yield fixpoint(problem, radial).normals
        yield fixpoint(problem, flooding).normals
    else:
        yield radial


def _floods(points: Array, spacing: float) -> Iterator[Flood]:
    """Yield floods from coarse to fine; finer, thinner walls enclose more volume until they leak."""
    longest = float(np.ptp(points, axis=0).max())
    for cells in FLOOD_CELLS:
        if cells == FLOOD_CELLS[0] or longest / cells > 0.6 * spacing:
            yield flooded(points, longest / cells)


def _inward(flood: Flood, points: Array) -> Array:
    """Return the gradient of a flood's smoothed inside at points."""
    smooth = ndimage.gaussian_filter(np.where(flood.outside, np.float32(-0.5), np.float32(0.5)), 1.5)
    return Indicator(flood.grid, smooth).at(points)[1]


def _opposed_to(normals: Array, inward: Array) -> Array:
    """Return the normals flipped to point against the given directions."""
    return np.where(dot(normals, inward)[:, None] > 0, -normals, normals)
