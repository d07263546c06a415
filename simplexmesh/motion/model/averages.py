"""Averages over the neighborhoods of vertices, whose radii are the rigidity of a motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.model import _kernels_averages
from simplexmesh.motion.model._kernels_step import Frames

Array = NDArray[np.float64]


class Averages:
    """Averages of values at the vertices of given frames and neighbors, in buffers that the next one overwrites."""

    def __init__(self, frames: Frames, neighbors: NDArray[np.int32]) -> None:
        self._frames, self._neighbors = frames, neighbors
        self._moment, self._scratch = np.zeros(len(neighbors)), np.zeros((2, len(neighbors)))

    def of(self, values: Array, passes: NDArray[np.int64], *, angles: bool = False) -> Array:
        """Return `values` (n,) after `passes` (n,) averages over the one-ring, a number for each vertex."""
        most = int(passes.max(initial=0))
        uniform = int(passes.min()) == most
        out = values if uniform else values.copy()
        for k in range(1, most + 1):
            into = self._scratch[k % 2]
            if angles:
                _kernels_averages.angle_averages(values, self._neighbors, self._frames.inverse_radius, into)
            else:
                _kernels_averages.averages(values, self._neighbors, into)
            values = into
            if uniform:
                out = into
            else:
                np.copyto(out, into, where=passes == k)
        return out

    def mean_curvature(self, rigidity: NDArray[np.int64]) -> Array:
        """Return the mean of H over Q^s, weighted by area: else tiny triangles of high curvature inflate large ones."""
        _kernels_averages.moments(self._frames.curvature, self._frames.area, self._moment)
        np.copyto(self._moment, self.of(self._moment, rigidity))
        area = self.of(self._frames.area, rigidity)
        _kernels_averages.quotients(self._moment, area, self._moment)
        return self._moment
