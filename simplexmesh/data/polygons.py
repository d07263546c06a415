"""Triangulation of polygons."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


def fans(sizes: Indices, flat: NDArray[Any]) -> Indices:
    """Return the triangles of polygons stored consecutively, each triangulated as a fan around its first corner.

    Examples
    --------
    >>> fans(np.array([4, 3]), np.array([0, 1, 2, 3, 5, 6, 7]))
    array([[0, 1, 2],
           [0, 2, 3],
           [5, 6, 7]])
    """
    corners = flat.astype(np.int64)
    starts = np.cumsum(sizes) - sizes
    cuts = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, cuts)
    step = np.arange(cuts.sum()) - np.repeat(np.cumsum(cuts) - cuts, cuts) + 1
    return np.stack([corners[first], corners[first + step], corners[first + step + 1]], axis=1)
