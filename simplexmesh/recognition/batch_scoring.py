"""Score and refine the motions of many models on the grid of one scene together."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition import _kernels_batch_scoring
from simplexmesh.recognition.grid_scoring import REFINING_WIDTHS, GridScorer

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BatchScorer:
    """Grid scorers with a common target and grid, one per model.

    Starting the threads takes as long as a hundred motions in one of them, so all models share one parallel loop.
    """

    scorers: list[GridScorer]

    def scores(self, motions: list[Array], *, stage: int = 0, every: int = 1) -> list[Array]:
        """Return the scores of motions (h, 12) of each model, as `GridScorer.scores`."""
        flat, owners = _concatenated(motions)
        out = np.zeros(len(flat))
        if len(flat):
            first = self.scorers[0]
            widths = np.array([scorer.width(stage) for scorer in self.scorers])
            _kernels_batch_scoring.score_motions_of_models(
                *(flat, owners, *self._samples([scorer.scoring_points[::every] for scorer in self.scorers])),
                *(first.grid, first.low, first.cell, first.target.planes),
                *(widths, np.maximum(2 * first.cell, 2 * widths), out),
            )
        return _split(out, motions)

    def refined(self, motions: list[Array], *, stage: int) -> list[Array]:
        """Return the refined motions (h, 12) of each model, as `GridScorer.refined`."""
        flat, owners = _concatenated(motions)
        if len(flat):
            first = self.scorers[0]
            points = [each.refining_points[:: 1 if stage else 2] for each in self.scorers]
            widths = [np.maximum(np.array(REFINING_WIDTHS[stage]) * each.size, 2 * each.noise) for each in self.scorers]
            _kernels_batch_scoring.refine_motions_of_models(
                *(flat, owners, *self._samples(points)),
                *(first.grid, first.low, first.cell, first.target.planes, np.array(widths)),
            )
        return _split(flat, motions)

    def _samples(self, chosen: list[NDArray[np.int64]]) -> tuple[Array, NDArray[np.int64]]:
        """Return points and normals of all models as columns (6, k), and offsets of each model (m + 1,)."""
        parts = [scorer.samples(rows) for scorer, rows in zip(self.scorers, chosen, strict=True)]
        return np.concatenate(parts, axis=1), np.cumsum([0, *map(len, chosen)])


def _concatenated(motions: list[Array]) -> tuple[Array, NDArray[np.int64]]:
    """Return the motions of all models in one array, and the model of each."""
    return np.concatenate([np.zeros((0, 12)), *motions]), np.repeat(np.arange(len(motions)), list(map(len, motions)))


def _split(values: Array, motions: list[Array]) -> list[Array]:
    """Return values of the motions of all models, split by model."""
    return [values[a:b] for a, b in pairwise(accumulate(map(len, motions), initial=0))]
