"""Many models in one scene: their motions are judged and followed together."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from simplexmesh.recognition import _kernels_arenas
from simplexmesh.recognition.arena import WIDTHS, Arena

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Arenas:
    """Arenas that have target and grid in common, one for each model.

    To start all threads takes as long as one of them takes for a hundred motions; so it is done for all models at once.
    """

    arenas: list[Arena]

    def scores(self, motions: list[Array], *, stage: int = 0, every: int = 1) -> list[Array]:
        """Return the scores of motions (h, 12) of each model; as `Arena.scores`."""
        flat, owners = _together(motions)
        out = np.zeros(len(flat))
        if len(flat):
            first = self.arenas[0]
            widths = np.array([arena.width(stage) for arena in self.arenas])
            _kernels_arenas.judge_all(
                *(flat, owners, *self._samples([arena.judging[::every] for arena in self.arenas])),
                *(first.grid, first.low, first.cell, first.target.planes),
                *(widths, np.maximum(2 * first.cell, 2 * widths), out),
            )
        return _apart(out, motions)

    def followed(self, motions: list[Array], *, stage: int) -> list[Array]:
        """Return motions (h, 12) of each model, moved to where it fits best around; as `Arena.followed`."""
        flat, owners = _together(motions)
        if len(flat):
            first = self.arenas[0]
            widths = [np.maximum(np.array(WIDTHS[stage]) * each.size, 2 * each.blur) for each in self.arenas]
            _kernels_arenas.follow_all(
                *(flat, owners, *self._samples([arena.following[:: 1 if stage else 2] for arena in self.arenas])),
                *(first.grid, first.low, first.cell, first.target.planes, np.array(widths)),
            )
        return _apart(flat, motions)

    def _samples(self, chosen: list[NDArray[np.int64]]) -> tuple[Array, NDArray[np.int64]]:
        """Return some points and normals of all models as columns (6, k), and where those of each begin."""
        parts = [arena.samples(some) for arena, some in zip(self.arenas, chosen, strict=True)]
        return np.concatenate(parts, axis=1), np.cumsum([0, *map(len, chosen)])


def _together(motions: list[Array]) -> tuple[Array, NDArray[np.int64]]:
    """Return the motions of all models one after the other, and whose each is."""
    return np.concatenate([np.zeros((0, 12)), *motions]), np.repeat(np.arange(len(motions)), list(map(len, motions)))


def _apart(told: Array, motions: list[Array]) -> list[Array]:
    """Return what is told of the motions of all models, of each by itself."""
    return [told[a:b] for a, b in pairwise(accumulate(map(len, motions), initial=0))]
