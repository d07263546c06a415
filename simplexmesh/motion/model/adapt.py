"""Curvature-adapted metric parameters, which concentrate vertices where the surface bends (Delingette 1994, 5.5.1).

The thesis takes C = |H|. Curvedness does not vanish on minimal saddles, which adaptation to |H| would drain of vertices
until the mesh spans them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.motion.model import _kernels_averages

Array = NDArray[np.float64]

LOWEST, HIGHEST = 0.05, 0.833
"""Bounds of the metric parameters (thesis, section 5.5.1), which keep vertices off their neighbors."""

FLAT = 0.005
"""Turn of the normal along a mean edge, in radians, below which a surface is flat and curvature is rounding error."""


def curvedness(vertices: Array, normals: Array, neighbors: NDArray[np.int32], *, shortest: float = 0.0) -> Array:
    """Return (n,) the rms change of normal per edge length, at least `shortest`, over the three neighbors.

    It tends to sqrt((k1^2 + k2^2) / 2) under refinement: 1 / R on a sphere.
    """
    out = np.zeros(len(vertices))
    _kernels_averages.curvedness(np.asarray(vertices), np.asarray(normals), neighbors, shortest, out)
    return out


def adapted_metric(
    metric: Array, curvature: Array, neighbors: NDArray[np.int32], *, strength: float, least: float = 1e-300
) -> Array:
    """Return metric parameters (n, 3) moved half way to ``1/3 + strength (C_j - mean_k C_k) / C``, C the curvature.

    The strength is reduced where needed to keep all three within `LOWEST`..`HIGHEST`, and C in the denominator is at
    least `least` and its mean over the mesh: on flat parts the thesis's ratio amplifies noise.
    """
    floor, out = max(float(np.abs(curvature).mean()), least), np.empty_like(metric)
    _kernels_averages.adapted(metric, curvature, floor, neighbors, float(strength), LOWEST, HIGHEST, out)
    return out
