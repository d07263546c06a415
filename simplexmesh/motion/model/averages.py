"""What a motion averages over neighborhoods, whose radii are its rigidity, and metric parameters adapted to curvature.

The latter concentrate vertices where the surface bends (Delingette 1994, 5.5.1). The thesis takes C = |H|, which would
drain minimal saddles of vertices until the mesh spans them; curvedness does not vanish there.
"""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Indices32
from simplexmesh.motion.model import _kernels_averages
from simplexmesh.motion.model._kernels_step import Frames

LOWEST, HIGHEST = 0.05, 0.833
"""Bounds of the metric parameters (thesis, section 5.5.1), which keep vertices off their neighbors."""

FLAT = 0.005
"""Turn of the normal along a mean edge, in radians, below which a surface is flat and curvature is rounding error."""


class Averages:
    """Averages of values at the vertices of given frames and neighbors, in buffers that the next one overwrites."""

    def __init__(self, frames: Frames, neighbors: Indices32) -> None:
        self._frames, self._neighbors = frames, neighbors
        self._moment, self._scratch = np.zeros(len(neighbors)), np.zeros((2, len(neighbors)))

    def of(self, values: Array, passes: Indices, *, angles: bool = False) -> Array:
        """Return `values` (n,) after `passes` (n,) averages over the one-ring, a number for each vertex."""
        most = int(passes.max(initial=0))
        uniform = int(passes.min()) == most
        out = values if uniform else values.copy()
        for k in range(1, most + 1):
            into = self._scratch[k % 2]
            if angles:
                _kernels_averages.angle_averages(
                    len(values), values, self._neighbors, self._frames.inverse_radius, into
                )
            else:
                _kernels_averages.averages(len(values), values, self._neighbors, into)
            values = into
            if uniform:
                out = into
            else:
                np.copyto(out, into, where=passes == k)
        return out

    def mean_curvature(self, rigidity: Indices) -> Array:
        """Return the mean of H over Q^s, weighted by area: else tiny triangles of high curvature inflate large ones."""
        moment = np.multiply(self._frames.curvature, self._frames.area, out=self._moment)
        np.copyto(moment, self.of(moment, rigidity))
        area = self.of(self._frames.area, rigidity)
        return np.divide(moment, area, out=moment, where=area > 0.0)


def curvedness(vertices: Array, normals: Array, neighbors: Indices32, *, shortest: float = 0.0) -> Array:
    """Return (n,) the rms change of normal per edge length, at least `shortest`: about sqrt((k1^2 + k2^2) / 2)."""
    out = np.zeros(len(vertices))
    _kernels_averages.curvedness(len(vertices), np.asarray(vertices), np.asarray(normals), neighbors, shortest, out)
    return out


def adapted_metric(
    metric: Array, curvature: Array, neighbors: Indices32, *, strength: float, least: float = 1e-300
) -> Array:
    """Return metric parameters (n, 3) moved half way to ``1/3 + strength (C_j - mean_k C_k) / C``, C the curvature."""
    floor, out = max(float(np.abs(curvature).mean()), least), np.empty_like(metric)  # the ratio amplifies noise
    _kernels_averages.adapted(len(metric), metric, curvature, floor, neighbors, float(strength), LOWEST, HIGHEST, out)
    return out
