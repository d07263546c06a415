"""Triangulation of polygons and strips."""

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
    corners = _whole(flat)
    starts = np.cumsum(sizes) - sizes
    cuts = np.maximum(sizes - 2, 0)
    first = np.repeat(starts, cuts)
    step = np.arange(cuts.sum()) - np.repeat(np.cumsum(cuts) - cuts, cuts) + 1
    return np.stack([corners[first], corners[first + step], corners[first + step + 1]], axis=1)


def strips(flat: NDArray[Any]) -> Indices:
    """Return the triangles of strips stored consecutively, with -1 after each; every other triangle is turned over.

    Examples
    --------
    >>> strips(np.array([0, 1, 2, 3, -1, 4, 5, 6]))
    array([[0, 1, 2],
           [2, 1, 3],
           [4, 5, 6]])
    """
    corners = _whole(flat)
    triples = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    ends = np.flatnonzero(corners < 0)
    starts = np.concatenate([[0], ends + 1])
    at = np.arange(len(triples))
    odd = (at - starts[np.searchsorted(starts, at, side="right") - 1]) % 2 == 1
    triples[odd] = triples[odd][:, [1, 0, 2]]
    a, b, c = triples.T
    return triples[(triples >= 0).all(axis=1) & (a != b) & (b != c) & (c != a)]


def _whole(corners: NDArray[Any]) -> Indices:
    """Return indices read from a file as integers."""
    if corners.dtype.kind == "f" and not (np.isfinite(corners) & (corners == np.rint(corners))).all():
        raise ValueError("faces must be whole numbers")
    return corners.astype(np.int64)
