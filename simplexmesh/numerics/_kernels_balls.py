"""Fixed-radius neighbor search in a cloud: points sorted into grid cells as wide as the radius."""
# mypy: allow-untyped-defs

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from simplexmesh._base._kernels_both import Both
from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices

BITS = 21
"""Bits per axis in a packed cell key."""


class Cells(NamedTuple):
    """Points (n, 3), sorted keys of their cells, the points of these, the first corner, the width, a radius."""

    points: Array
    ordered: Indices
    order: Indices
    low: Array
    width: float
    radius: float


@njit(cache=True)
def cell_keys(points, low, width):
    """Return the packed cell key of each point; cells that are consecutive along z have consecutive keys."""
    out = np.empty(points.shape[0], np.int64)
    for i in range(points.shape[0]):
        key = 0
        for axis in range(3):
            key = (key << BITS) | (1 + int((points[i, axis] - low[axis]) / width))
        out[i] = key
    return out


@njit(cache=True)
def _around(given, i, out, place):
    """Count the points within the radius of point i; if `place` is not negative, write them from there on."""
    points, ordered, order, low, width, radius = given
    count = 0
    cells = (
        1 + int((points[i, 0] - low[0]) / width),
        1 + int((points[i, 1] - low[1]) / width),
        1 + int((points[i, 2] - low[2]) / width),
    )
    for x in range(cells[0] - 1, cells[0] + 2):
        for y in range(cells[1] - 1, cells[1] + 2):
            column = ((x << BITS) | y) << BITS
            begin = np.searchsorted(ordered, column | (cells[2] - 1))
            for k in range(begin, ordered.shape[0]):
                if ordered[k] > column | (cells[2] + 1):
                    break
                j = order[k]
                if j == i:
                    continue
                square = 0.0
                for axis in range(3):
                    square += (points[j, axis] - points[i, axis]) ** 2
                if square <= radius * radius:
                    if place >= 0:
                        out[place + count] = j
                    count += 1
    return count


@Both
def count(centers, cells, counts):
    """Fill the number of points within the radius of each center, the center excluded."""
    for row in prange(centers.shape[0]):
        counts[row] = _around(cells, centers[row], cells.order, -1)


@Both
def fill(centers, cells, offsets, members):
    """Fill the points counted by `count`, in ascending order."""
    for row in prange(centers.shape[0]):
        _around(cells, centers[row], members, offsets[row])
        members[offsets[row] : offsets[row + 1]].sort()
