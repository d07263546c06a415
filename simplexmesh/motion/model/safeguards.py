"""Safeguards of a motion: parts that fold are released to contract, and vertices stay near the start and the data.

Forces along normals of folded vertices are the known trap of deformable models: their sides are confused, what they
are averaged with is not their surface, and parts of constant mean curvature that no data holds grow without bound.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.errors import counted, warn
from simplexmesh.motion.model import _kernels_averages

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MARGIN = 0.05
"""Of the diagonal of start and data: how far beyond their bounding box a vertex may swing, if not two edges."""

RINGS = 12
"""Edges from a fold within which vertices without data are released; less leaves films around bodies."""

MOST_UNSEEN = 0.25
"""Fraction of the vertices without data within reach above which the end of a motion is warned of."""


class Release:
    """The vertices released by a motion: the folded ones, and those without data that folds have spread to.

    They get no curvature and no data, so that they unfold or contract, as a film spanned by the rest, until they find
    data. Where nothing folds nothing changes.
    """

    def __init__(self, count: int) -> None:
        self._rings, self._other = np.zeros(count, np.int8), np.zeros(count, np.int8)

    @property
    def mask(self) -> Mask:
        """(n,) bool: the vertices released now."""
        return self._rings > 0

    def update(self, normals: Array, neighbors: NDArray[np.int32], gaps: Array) -> Mask:
        """Return (n,) the vertices released now, given their gaps (n,)."""
        _kernels_averages.released(normals, neighbors, gaps, RINGS, self._rings, self._other)
        self._rings, self._other = self._other, self._rings
        return self.mask


class Confines:
    """The box around the start of a motion and the `bounds` (2, 3) of its target, if it has such."""

    def __init__(self, start: Array, neighbors: NDArray[np.int32], target: Any) -> None:
        self.target, self._box = target, None
        bounds: Any = getattr(target, "bounds", None)
        if np.shape(bounds) == (2, 3):
            low, high = np.minimum(start.min(axis=0), bounds[0]), np.maximum(start.max(axis=0), bounds[1])
            edge = float(np.linalg.norm(start[neighbors] - start[:, None], axis=2).mean())
            margin = max(MARGIN * float(np.linalg.norm(high - low)), 2.0 * edge)
            self._box = low - margin, high + margin

    def stray(self, vertices: Array) -> int:
        """Return the first vertex outside, -1 for none."""
        if self._box is None:
            return -1
        out = (vertices < self._box[0]) | (vertices > self._box[1])
        return int(out.any(axis=1).argmax()) if out.any() else -1


def warn_of_end(released: Mask, gaps: Array, reach: float) -> None:
    """Warn at the end of a motion of vertices that are folded, or were left without data by folds, or never had any."""
    unseen = float(np.isnan(gaps).mean())
    if released.any():
        count = counted(int(released.sum()), "vertex is", "vertices are")
        warn(f"{count} folded, or off the data beside folds; a start nearer to the data, or more vertices, may help")
    elif unseen > MOST_UNSEEN:
        warn(f"{unseen:.0%} of the vertices have no data within reach ({reach:.3g}) along their normals")
