"""Globally consistent orientation of point normals by iterated Poisson reconstruction.

Consistently oriented normals are the gradient of an indicator function; where some are flipped they cancel. So the
indicator of the current normals tells which to flip, repeatedly, and its energy tells which of several initializations
converged best.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._vec import dot
from simplexmesh.motion.initial.flood import Flood, flooded
from simplexmesh.motion.initial.grid import Grid
from simplexmesh.motion.initial.indicator import Indicator, grid_for, point_areas, poisson_indicator, transfer_function
from simplexmesh.motion.initial.planes import Planes

Array = NDArray[np.float64]

FLOOD_CELLS = (16, 24, 32, 48, 64, 96, 128, 192, 256)
COARSE_CELLS = 32
_FINEST = 0.6
_CONVERGED = 1e-3
_MAX_ITERATIONS = 8


@dataclass(frozen=True, eq=False)
class _Fixpoint:
    """Converged normals, their energy, the number of iterations, and their indicator if none was flipped last."""

    normals: Array
    energy: float
    iterations: int
    field: Indicator | None


@dataclass(frozen=True, eq=False)
class _Problem:
    """Points with a grid, the area each point represents there, and the transfer function of the grid."""

    points: Array
    grid: Grid
    weight: Array
    transfer: NDArray[np.complex64]

    @staticmethod
    def of(points: Array, cell: float) -> _Problem:
        grid = grid_for(points, cell)
        return _Problem(points, grid, point_areas(points, grid), transfer_function(grid.shape))

    def indicator(self, normals: Array) -> Indicator:
        return poisson_indicator(self.points, normals, self.grid, self.weight, self.transfer)

    def iterate(self, normals: Array) -> _Fixpoint:
        """Flip normals that contradict their indicator until hardly any do."""
        iterations = 0
        for iterations in range(1, _MAX_ITERATIONS + 1):  # noqa: B007
            field = self.indicator(normals)
            slope = dot(normals, field.at(self.points)[1])
            energy = -float((self.weight * slope).sum())
            wrong = slope > 0
            normals = np.where(wrong[:, None], -normals, normals)
            if np.count_nonzero(wrong) < _CONVERGED * len(normals):
                break
        return _Fixpoint(normals, energy, iterations, None if wrong.any() else field)


def oriented_indicator(points: Array, found: Planes, cell: float) -> Indicator:
    """Return the indicator function of the solid that unoriented points bound.

    The first initialization comes from the finest flood that does not leak. Unless it converges at once, others are
    tried: the next best flood, and normals pointing away from the centroid, iterated on a coarse grid first, where
    holes in the data close. The one whose indicator has the largest energy on cells of twice the size is continued on
    the requested grid.

    Parameters
    ----------
    points : (n, 3) array of float
    found : Planes
        Unoriented normals, from `planes(points)`.
    cell : float
        Side of the cells of the result.

    References
    ----------
    F. Hou, C. Wang, W. Wang, H. Qin, C. Qian, Y. He, Iterative Poisson surface reconstruction for unoriented points,
    ACM Trans. Graph. 41, 2022 (there from random normals, without the energy criterion).
    """
    coarse = _Problem.of(points, 2 * cell)
    best, most = found.normals, -np.inf
    for normals in _initial_normals(points, found, cell):
        fixpoint = coarse.iterate(normals)
        first = most == -np.inf
        if fixpoint.energy > most:
            best, most = fixpoint.normals, fixpoint.energy
        if first and fixpoint.iterations == 1:
            break
    fine = _Problem.of(points, cell)
    fixpoint = fine.iterate(best)
    return fixpoint.field or fine.indicator(fixpoint.normals)


def _initial_normals(points: Array, found: Planes, cell: float) -> Iterator[Array]:
    """Yield candidate orientations of the normals, the most likely first."""
    floods = sorted(_floods(points, found.spacing), key=lambda flood: -flood.enclosed)
    flooding = _opposed_to(found.normals, _inward(floods[0], points))
    yield flooding
    for flood in floods[1:2]:
        yield _opposed_to(found.normals, _inward(flood, points))
    coarse = float(np.ptp(points, axis=0).max()) / COARSE_CELLS
    radial = _opposed_to(found.normals, points.mean(axis=0) - points)
    if coarse > 2.5 * cell:
        problem = _Problem.of(points, coarse)
        yield problem.iterate(radial).normals
        yield problem.iterate(flooding).normals
    else:
        yield radial


def _floods(points: Array, spacing: float) -> Iterator[Flood]:
    """Yield floods from coarse to fine; finer, thinner walls enclose more volume until they leak."""
    longest = float(np.ptp(points, axis=0).max())
    for cells in FLOOD_CELLS:
        if cells == FLOOD_CELLS[0] or longest / cells > _FINEST * spacing:
            yield flooded(points, longest / cells)


def _inward(flood: Flood, points: Array) -> Array:
    """Return the gradient of a flood's smoothed inside at points."""
    smooth = ndimage.gaussian_filter(np.where(flood.outside, np.float32(-0.5), np.float32(0.5)), 1.5)
    return Indicator(flood.grid, smooth).at(points)[1]


def _opposed_to(normals: Array, inward: Array) -> Array:
    """Return the normals flipped to point against the given directions."""
    return np.where(dot(normals, inward)[:, None] > 0, -normals, normals)
