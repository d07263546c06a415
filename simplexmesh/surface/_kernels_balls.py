"""All points of a cloud within a distance of some of them, from points sorted into cells as wide as the distance."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit

BITS = 21
"""Of a cell's number along each axis."""


@njit(cache=True)
def keys(points, low, width):
    """Return one whole number per point that tells its cell; cells along z follow each other."""
    out = np.empty(points.shape[0], np.int64)
    for i in range(points.shape[0]):
        key = 0
        for axis in range(3):
            key = (key << BITS) | (1 + int((points[i, axis] - low[axis]) / width))
        out[i] = key
    return out


@njit(cache=True)
def _around(points, ordered, order, low, width, radius, i, out, place):
    """Count the points within `radius` of point i, writing them from `place` on where it is not negative."""
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
def count(centers, points, ordered, order, low, width, radius, counts):
    """Fill how many points are within `radius` of each center, itself left out."""
    for row in prange(centers.shape[0]):
        counts[row] = _around(points, ordered, order, low, width, radius, centers[row], order, -1)


@Both
def fill(centers, points, ordered, order, low, width, radius, offsets, members):
    """Fill who they are, rising."""
    for row in prange(centers.shape[0]):
        _around(points, ordered, order, low, width, radius, centers[row], members, offsets[row])
        members[offsets[row] : offsets[row + 1]].sort()
