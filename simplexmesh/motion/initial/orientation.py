"""Which way is out: normals of either sign turned so that together they bound a body.

Turned rightly, the normals are the gradient of an indicator; turned wrongly in places they cancel there. So the
indicator of the normals as they are says where to turn them, again and again, and the energy of the indicator says
which of several beginnings ended best.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from simplexmesh._vec import dot
from simplexmesh.motion.initial.flood import Flood, flooded
from simplexmesh.motion.initial.frame import Frame
from simplexmesh.motion.initial.indicator import Indicator, answer, areas, frame_for, solved
from simplexmesh.motion.initial.planes import Planes

Array = NDArray[np.float64]

GRIDS = (16, 24, 32, 48, 64, 96, 128, 192, 256)
COARSE = 32
_FINEST = 0.6
_TURNED = 1e-3
_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class _Settled:
    """Normals that hardly turn any more, their energy, how many rounds, and their field if none turned last."""

    normals: Array
    energy: float
    rounds: int
    field: Indicator | None


@dataclass(frozen=True, eq=False)
class _Level:
    """Points on a grid, with the area each stands for there."""

    points: Array
    frame: Frame
    weight: Array
    known: NDArray[np.complex64]

    @staticmethod
    def of(points: Array, cell: float) -> _Level:
        frame = frame_for(points, cell)
        return _Level(points, frame, areas(points, frame), answer(frame.shape))

    def solved(self, normals: Array) -> Indicator:
        return solved(self.points, normals, self.frame, self.weight, self.known)

    def settled(self, normals: Array) -> _Settled:
        """Turn normals until hardly any turns."""
        rounds = 0
        for rounds in range(1, _ROUNDS + 1):  # noqa: B007
            field = self.solved(normals)
            slope = dot(normals, field.at(self.points)[1])
            energy = -float((self.weight * slope).sum())
            wrong = slope > 0
            normals = np.where(wrong[:, None], -normals, normals)
            if np.count_nonzero(wrong) < _TURNED * len(normals):
                break
        return _Settled(normals, energy, rounds, None if wrong.any() else field)


def turned(points: Array, found: Planes, cell: float) -> Indicator:
    """Return the indicator of the body that points bound, from the planes through their neighbors.

    The first beginning is the finest flood that does not leak. Unless it settles at once, others are tried: the
    next best floods, and all normals away from the middle of the points, settled on a coarse grid first, where holes
    in the data close. The one whose indicator has most energy on cells of twice the side goes on to the cells asked
    for.

    Parameters
    ----------
    points : (n, 3) array of float
    found : Planes
        From `planes(points)`.
    cell : float
        Side of the cells of the result.

    References
    ----------
    F. Hou, C. Wang, W. Wang, H. Qin, C. Qian, Y. He, Iterative Poisson surface reconstruction for unoriented points,
    ACM Trans. Graph. 41, 2022 (there from random normals, without energy).
    """
    middle = _Level.of(points, 2 * cell)
    best, most = found.normals, -np.inf
    for normals in _beginnings(points, found, cell):
        settled = middle.settled(normals)
        first = most == -np.inf
        if settled.energy > most:
            best, most = settled.normals, settled.energy
        if first and settled.rounds == 1:
            break
    fine = _Level.of(points, cell)
    settled = fine.settled(best)
    return settled.field or fine.solved(settled.normals)


def _beginnings(points: Array, found: Planes, cell: float) -> Iterator[Array]:
    """Yield normals turned in ways that may be right, the likeliest first."""
    floods = sorted(_floods(points, found.spacing), key=lambda flood: -flood.hollow)
    flooding = _facing(found.normals, _inwards(floods[0], points))
    yield flooding
    for flood in floods[1:2]:
        yield _facing(found.normals, _inwards(flood, points))
    coarse = float(np.ptp(points, axis=0).max()) / COARSE
    radial = _facing(found.normals, points.mean(axis=0) - points)
    if coarse > 2.5 * cell:
        level = _Level.of(points, coarse)
        yield level.settled(radial).normals
        yield level.settled(flooding).normals
    else:
        yield radial


def _floods(points: Array, spacing: float) -> Iterator[Flood]:
    """Yield floods from coarse to fine; finer walls are thinner, enclose more, until they leak and enclose nothing."""
    longest = float(np.ptp(points, axis=0).max())
    for cells in GRIDS:
        if cells == GRIDS[0] or longest / cells > _FINEST * spacing:
            yield flooded(points, longest / cells)


def _inwards(flood: Flood, points: Array) -> Array:
    """Return the direction away from the outside of a flood, at points."""
    smooth = ndimage.gaussian_filter(np.where(flood.outside, np.float32(-0.5), np.float32(0.5)), 1.5)
    return Indicator(flood.frame, smooth).at(points)[1]


def _facing(normals: Array, inwards: Array) -> Array:
    """Return the normals turned to point against given directions."""
    return np.where(dot(normals, inwards)[:, None] > 0, -normals, normals)
