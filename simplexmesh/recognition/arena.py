"""Two surfaces in one unit, the target on a grid that knows which of its points is about nearest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition import _kernels_cells, _kernels_register
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

CELLS = 64
MARGIN = 6
JUDGING = (0.03, 0.015, 0.006)
"""Distances to planes that still speak for a motion, in sizes of the smaller surface, at each stage."""

JUDGED, FOLLOWED = 400, 700
"""So many points of the source judge a motion, and move one."""

WIDTHS = (
    (0.10, 0.09, 0.08, 0.07, 0.06, 0.05),
    (0.06, 0.05, 0.045, 0.04, 0.035, 0.03, 0.025, 0.022, 0.02, 0.02, 0.02),
)
"""Widths of the weights while a motion is followed, in shares of the smaller surface's size."""

APART = np.radians(8.0)
FAR = 0.06
"""Motions nearer than this to each other are one."""


@dataclass(frozen=True, eq=False)
class Arena:
    """Source and target, shifted to the target's middle and scaled by the larger extent.

    Attributes
    ----------
    source, target : Surface
        Smooth.
    judging, following : (m,) array of int
        Points of the source.
    grid : (i, j, k) array of int32
    low : (3,) array of float
    cell : float
    size : float
        Extent of the smaller surface.
    """

    source: Surface
    target: Surface
    judging: NDArray[np.int64]
    following: NDArray[np.int64]
    grid: NDArray[np.int32]
    low: Array
    cell: float
    size: float

    @property
    def blur(self) -> float:
        """How far points of one surface scatter about the other where both agree."""
        return float(np.hypot(self.source.noise, self.target.noise))

    def width(self, stage: int) -> float:
        """Farther from the target's planes than this, points speak against a motion."""
        return float(np.hypot(JUDGING[stage] * self.size, 2 * self.blur))

    def samples(self, chosen: NDArray[np.int64]) -> Array:
        """Return some points of the source and their normals as columns (6, k)."""
        return np.concatenate([self.source.points[chosen], self.source.normals[chosen]], axis=1).T.copy()

    def scores(self, motions: Array, *, stage: int = 0, every: int = 1) -> Array:
        """Return the scores of motions (h, 12), at most 1; stages count how often they were followed.

        About so many times faster and rougher where not `every` point judges.
        """
        out = np.zeros(len(motions))
        chosen, width = self.judging[::every], self.width(stage)
        _kernels_register.judge(
            *(motions, self.samples(chosen), self.grid, self.low, self.cell),
            *(self.target.planes, width, max(2 * self.cell, 2 * width), out),
        )
        return out

    def followed(self, motions: Array, *, stage: int) -> Array:
        """Return motions (h, 12) moved to where the source fits the target best around: roughly (0), then well (1)."""
        out = motions.copy()
        chosen = self.following[:: 1 if stage else 2]
        widths = np.maximum(np.array(WIDTHS[stage]) * self.size, 2 * self.blur)
        _kernels_register.follow(
            *(out, self.samples(chosen), self.grid, self.low, self.cell),
            *(self.target.planes, widths),
        )
        return out

    def distinct(self, motions: Array, most: int, apart: float = APART, far: float = FAR) -> NDArray[np.int64]:
        """Return which motions, in order, differ from all kept before, at most so many.

        Those are one that turn by less than `apart` from each other, in radians, and take the source's middle nearer
        than `far`, in sizes of the smaller surface. The source's middle is zero.
        """
        kept = np.empty(most, np.int64)
        count = _kernels_register.differing(motions, 1 + 2 * np.cos(apart), far * self.size, kept)
        return kept[:count]


def arena_of(source: Surface, target: Surface, rng: np.random.Generator) -> tuple[Arena, Array, float]:
    """Return the arena, and the point and the length that were taken for zero and for one."""
    middle, unit = target.points.mean(axis=0), max(source.extent, target.extent)
    here, there = source.placed(source.points.mean(axis=0), unit).smoothed(), target.placed(middle, unit).smoothed()
    grid, low, cell = grid_of(there.points)
    size = min(source.extent, target.extent) / unit
    return Arena(here, there, here.some(JUDGED, rng), here.some(FOLLOWED, rng), grid, low, cell, size), middle, unit


def grid_of(points: Array) -> tuple[NDArray[np.int32], Array, float]:
    """Return a grid around points that knows which is about nearest to each cell, its corner, and its cells' side.

    Examples
    --------
    >>> grid, low, cell = grid_of(np.array([[0.0, 0, 0], [1, 0, 0]]))
    >>> x = ((np.array([0.1, 0, 0]) - low) / cell).astype(int)
    >>> int(grid[tuple(x)])
    0
    """
    low, high = points.min(axis=0), points.max(axis=0)
    cell = float((high - low).max()) / CELLS
    low = low - MARGIN * cell
    shape = (np.ceil((high - low) / cell) + MARGIN).astype(int)
    places = ((points - low) / cell).astype(int)
    holder = np.full(shape, -1, np.int32)
    holder[tuple(places.T)] = np.arange(len(places))
    grid = np.empty_like(holder)
    _kernels_cells.fill_nearest(holder, grid)
    return grid, low, cell


def rows(R: Array, t: Array) -> Array:
    """Return motions (h, 12) of rotations (h, 3, 3) and shifts (h, 3)."""
    return np.concatenate([R, t[:, :, None]], axis=2).reshape(-1, 12)
