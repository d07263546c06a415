"""Score and refine motions on a grid that stores an approximately nearest target point per cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from scipy import ndimage

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm
from simplexmesh.recognition.register import _kernels_pose_scoring
from simplexmesh.recognition.register._kernels_pose_scoring import SourceColumns, TargetGrid
from simplexmesh.recognition.register.oriented_points import OrientedPoints

CELLS, MARGIN = 64, 6
"""Cells along the longest side of the target, and around it: finer cells take longer to fill than they save steps."""

SCORING_WIDTHS = (0.03, 0.015, 0.006)
"""Distance to planes at which the score is 0, after no, a coarse and a fine refinement; in sizes of the smaller."""

SAME_ANGLE, SAME_SHIFT = np.radians(8.0), 0.06
"""Rotation, and shift of the center in sizes of the smaller surface, below which motions are duplicates."""

REFINING_WIDTHS = (np.linspace(0.10, 0.05, 6), np.geomspace(0.06, 0.02, 11))
"""Widths of the weights at each step of a coarse and of a fine refinement, in sizes of the smaller surface."""


@dataclass(frozen=True, eq=False)
class Source:
    """A surface about the origin whose motions are scored, and the rows (k,) of the points that this is done with."""

    surface: OrientedPoints
    scoring_rows: Indices
    refining_rows: Indices
    size: float  # extent of the smaller of source and target
    noise: float  # standard deviation of the distance between them

    def columns(self, rows: Indices) -> Array:
        """Return points and their normals as columns (6, k)."""
        return np.concatenate([self.surface.points[rows], self.surface.normals[rows]], axis=1).T.copy()

    def scoring_width(self, stage: int) -> float:
        """Return the distance to the target's planes beyond which points score below 0."""
        return float(np.hypot(SCORING_WIDTHS[stage] * self.size, 2 * self.noise))


def source_of(surface: OrientedPoints, target: OrientedPoints, rows: tuple[Indices, Indices], size: float) -> Source:
    """Return a source with the rows of the points to score and to refine with; `size` is that of the smaller."""
    return Source(surface, *rows, size, float(np.hypot(surface.noise, target.noise)))


def scores(
    sources: Sequence[Source], grid: TargetGrid, motions: list[Array], *, stage: int = 0, every: int = 1
) -> list[Array]:
    """Return the scores (h,), at most 1, of the motions (h, 12) of each source, after `stage` refinements."""
    flat, owners = _concatenated(motions)
    out = np.zeros(len(flat))
    columns = _columns(sources, [each.scoring_rows[::every] for each in sources])
    widths = np.array([each.scoring_width(stage) for each in sources])
    _kernels_pose_scoring.score_motions(len(flat), flat, owners, columns, grid, widths, out)
    return _split(out, motions)


def refined(sources: Sequence[Source], grid: TargetGrid, motions: list[Array], *, stage: int) -> list[Array]:
    """Return the motions (h, 12) of each source after point-to-plane steps: coarse (stage 0) or fine (1)."""
    flat, owners = _concatenated(motions)
    columns = _columns(sources, [each.refining_rows[:: 1 if stage else 2] for each in sources])
    widths = np.array([REFINING_WIDTHS[stage] * each.size for each in sources])
    _kernels_pose_scoring.refine_motions(len(flat), flat, owners, columns, grid, widths)
    return _split(flat, motions)


def _columns(sources: Sequence[Source], rows: list[Indices]) -> SourceColumns:
    parts = [source.columns(each) for source, each in zip(sources, rows, strict=True)]
    return SourceColumns(np.concatenate(parts, axis=1), np.cumsum([0, *map(len, rows)]))


def _concatenated(motions: list[Array]) -> tuple[Array, Indices]:
    """Return the motions of all sources in one array, and the source of each."""
    return np.concatenate(motions), np.repeat(np.arange(len(motions)), list(map(len, motions)))


def _split(values: Array, motions: list[Array]) -> list[Array]:
    """Return values of the motions of all sources, split by source."""
    return [values[a:b] for a, b in pairwise(accumulate(map(len, motions), initial=0))]


def distinct(motions: Array, maximum: int, size: float, *, factor: float = 1.0) -> Indices:
    """Return up to `maximum` indices of motions (h, 12) that differ; `factor` widens what counts as the same."""
    R, t = np.split(motions.reshape(-1, 3, 4), [3], axis=2)
    least, far = 1 + 2 * np.cos(factor * SAME_ANGLE), factor * SAME_SHIFT * size
    kept: list[int] = []
    for k in range(len(motions)):
        if len(kept) == maximum:
            break
        same = (np.einsum("kab,ab->k", R[kept], R[k]) > least) & (norm(t[kept, :, 0] - t[k, :, 0]) < far)
        if not same.any():
            kept.append(k)
    return np.array(kept, np.int64)


def target_grid(target: OrientedPoints) -> TargetGrid:
    """Return the grid of a target: the point nearest to each cell, of several in a cell the last."""
    low, high = target.points.min(axis=0), target.points.max(axis=0)
    cell = float((high - low).max()) / CELLS
    low = low - MARGIN * cell
    cells = ((target.points - low) / cell).astype(int)
    seeds = np.full((np.ceil((high - low) / cell) + MARGIN).astype(int), -1, np.int32)
    seeds[tuple(cells.T)] = np.arange(len(cells))
    nearest = ndimage.distance_transform_edt(seeds < 0, return_distances=False, return_indices=True)
    return TargetGrid(np.hstack([target.points, target.normals]), seeds[tuple(nearest)], low, cell)


def motion_rows(R: Array, t: Array) -> Array:
    """Return motions as rows (h, 12) from rotations (h, 3, 3) and shifts (h, 3)."""
    return np.concatenate([R, t[:, :, None]], axis=2).reshape(-1, 12)
