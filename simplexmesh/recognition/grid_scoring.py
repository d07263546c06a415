"""Score and refine motions on a grid that stores an approximately nearest target point per cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition import _kernels_distance_transform, _kernels_grid_scoring
from simplexmesh.recognition.surfaces import Surface

Array = NDArray[np.float64]

CELLS = 64
MARGIN = 6
SCORING_WIDTHS = (0.03, 0.015, 0.006)
"""Distance to planes at which the score is 0, at each stage, relative to the size of the smaller surface."""

SCORED, REFINED = 400, 700
"""Numbers of source points that motions are scored and refined with."""

REFINING_WIDTHS = (
    (0.10, 0.09, 0.08, 0.07, 0.06, 0.05),
    (0.06, 0.05, 0.045, 0.04, 0.035, 0.03, 0.025, 0.022, 0.02, 0.02, 0.02),
)
"""Widths of the weights at each step of a refinement, relative to the size of the smaller surface."""

SAME_ANGLE = np.radians(8.0)
SAME_SHIFT = 0.06
"""Motions nearer than this to each other are duplicates."""


@dataclass(frozen=True, eq=False)
class GridScorer:
    """Source and target in a normalized frame: centered, and scaled by the larger extent.

    Attributes
    ----------
    source, target : Surface
        Points projected to local planes.
    scoring_points, refining_points : (m,) array of int
        Indices of source points.
    grid : (i, j, k) array of int32
        Index of the target point nearest to each cell.
    low : (3,) array of float
        Corner of the grid.
    cell : float
        Side of a cell.
    size : float
        Extent of the smaller surface.
    """

    source: Surface
    target: Surface
    scoring_points: NDArray[np.int64]
    refining_points: NDArray[np.int64]
    grid: NDArray[np.int32]
    low: Array
    cell: float
    size: float

    @property
    def noise(self) -> float:
        """Standard deviation of the distance between the surfaces where they agree."""
        return float(np.hypot(self.source.noise, self.target.noise))

    def width(self, stage: int) -> float:
        """Distance to the target's planes beyond which points score below 0."""
        return float(np.hypot(SCORING_WIDTHS[stage] * self.size, 2 * self.noise))

    def samples(self, chosen: NDArray[np.int64]) -> Array:
        """Return points of the source and their normals as columns (6, k)."""
        return np.concatenate([self.source.points[chosen], self.source.normals[chosen]], axis=1).T.copy()

    def scores(self, motions: Array, *, stage: int = 0, every: int = 1) -> Array:
        """Return the scores of motions (h, 12), at most 1; `stage` is the number of refinements before.

        Only each `every`-th scoring point is used.
        """
        out = np.zeros(len(motions))
        chosen, width = self.scoring_points[::every], self.width(stage)
        _kernels_grid_scoring.score_motions(
            *(motions, self.samples(chosen), self.grid, self.low, self.cell),
            *(self.target.planes, width, max(2 * self.cell, 2 * width), out),
        )
        return out

    def refined(self, motions: Array, *, stage: int) -> Array:
        """Return motions (h, 12) refined by point-to-plane steps: coarsely (stage 0), then finely (1)."""
        out = motions.copy()
        chosen = self.refining_points[:: 1 if stage else 2]
        widths = np.maximum(np.array(REFINING_WIDTHS[stage]) * self.size, 2 * self.noise)
        _kernels_grid_scoring.refine_motions(
            *(out, self.samples(chosen), self.grid, self.low, self.cell),
            *(self.target.planes, widths),
        )
        return out

    def distinct(
        self, motions: Array, maximum: int, angle: float = SAME_ANGLE, shift: float = SAME_SHIFT
    ) -> NDArray[np.int64]:
        """Return the indices of up to `maximum` motions, in order, that differ from all before.

        Two motions are the same if they differ by less than `angle`, in radians, and move the source's center, which is
        the origin, by less than `shift`, in sizes of the smaller surface.
        """
        kept = np.empty(maximum, np.int64)
        count = _kernels_grid_scoring.distinct_motions(motions, 1 + 2 * np.cos(angle), shift * self.size, kept)
        return kept[:count]


def grid_scorer(source: Surface, target: Surface, rng: np.random.Generator) -> tuple[GridScorer, Array, float]:
    """Return the scorer of two surfaces, and the center and unit of its normalized frame."""
    center, unit = target.points.mean(axis=0), max(source.extent, target.extent)
    moving = source.normalized_to(source.points.mean(axis=0), unit).on_planes()
    fixed = target.normalized_to(center, unit).on_planes()
    size = min(source.extent, target.extent) / unit
    samples = moving.sample(SCORED, rng), moving.sample(REFINED, rng)
    grid, low, cell = nearest_grid(fixed.points)
    return GridScorer(moving, fixed, *samples, grid, low, cell, size), center, unit


def nearest_grid(points: Array) -> tuple[NDArray[np.int32], Array, float]:
    """Return a grid (i, j, k) with the index of the point nearest to each cell, its corner (3,) and its cell size.

    Of several points in a cell the last is kept.

    Examples
    --------
    >>> grid, low, cell = nearest_grid(np.array([[0.0, 0, 0], [1, 0, 0]]))
    >>> x = ((np.array([0.1, 0, 0]) - low) / cell).astype(int)
    >>> int(grid[tuple(x)])
    0
    """
    low, high = points.min(axis=0), points.max(axis=0)
    cell = float((high - low).max()) / CELLS
    low = low - MARGIN * cell
    shape = (np.ceil((high - low) / cell) + MARGIN).astype(int)
    cells = ((points - low) / cell).astype(int)
    seeds = np.full(shape, -1, np.int32)
    seeds[tuple(cells.T)] = np.arange(len(cells))
    grid = np.empty_like(seeds)
    _kernels_distance_transform.fill_nearest(seeds, grid)
    return grid, low, cell


def motion_rows(R: Array, t: Array) -> Array:
    """Return motions as rows (h, 12) from rotations (h, 3, 3) and shifts (h, 3)."""
    return np.concatenate([R, t[:, :, None]], axis=2).reshape(-1, 12)
