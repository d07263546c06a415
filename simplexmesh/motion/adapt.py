"""Metric parameters that follow curvature: vertices gather where the surface bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LOWEST, HIGHEST = 0.05, 0.833
"""Metric parameters stay in this range (thesis, section 5.5.1): no vertex lands on a neighbour."""


def adapted_metric(metric: Array, curvature: Array, neighbors: NDArray[np.int32], *, strength: float) -> Array:
    """Return reference metric parameters drawn half way towards the neighbours of higher curvature.

    Each wanted parameter is ``1/3 + strength * dH_j`` with ``dH_j = (|H_j| - mean_k |H_k|) / |H|`` over the three
    neighbours, `strength` reduced where needed to keep all three within `LOWEST`..`HIGHEST` (Delingette 1994, 5.5.1).

    Parameters
    ----------
    metric : (n, 3) array of float
        Reference metric parameters now; rows sum to 1.
    curvature : (n,) array of float
        Mean curvature; its sign does not matter.
    neighbors : (n, 3) array of int
    strength : float
        0 leaves evenly spaced vertices, 0.25 is strong.

    Returns
    -------
    (n, 3) array of float

    Examples
    --------
    >>> even = np.full((4, 3), 1 / 3)
    >>> tetrahedron = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    >>> adapted_metric(even, np.array([1.0, 1.0, 1.0, 4.0]), tetrahedron, strength=0.1)[0].round(3)
    array([0.283, 0.283, 0.433])
    """
    size = np.abs(curvature)
    around = size[neighbors]
    contrast = around - around.mean(axis=1, keepdims=True)
    contrast /= np.maximum(size, 1e-9 * size.max(initial=0.0) + 1e-300)[:, None]
    with np.errstate(divide="ignore"):  # an even neighbourhood has no contrast, hence no limit
        up = (HIGHEST - 1 / 3) / contrast.max(axis=1)
        down = (LOWEST - 1 / 3) / contrast.min(axis=1)
    limited = np.minimum(strength, np.minimum(up, np.where(down > 0, down, np.inf)))[:, None] * contrast
    return metric + 0.5 * (1 / 3 + limited - metric)
