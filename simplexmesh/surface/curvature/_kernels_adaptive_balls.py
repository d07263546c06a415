"""Balls of points around a center: gathering along edges, which side they lie on, which of them are to be fitted."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import int32, int64, uint64

from simplexmesh._kernels_both import FAST
from simplexmesh._kernels_njit import njit

CAPACITY, ENOUGH = 352, 245
"""Most points gathered; balls of more than enough are shortened to hold about that many, for speed."""

STEEP = 0.64
"""Points whose height above the tangent plane exceeds 0.8 of their distance are left out; squared."""

BLOCK = 32
"""Loops over points run to a multiple of this, a whole number of vector registers; zeros follow the last point."""

ZERO, ONE = np.uint64(0), np.uint64(1)
"""Indices are unsigned: numba tests signed ones for negative values, which costs a sixth of the time of gathering."""

jit = njit(cache=True, error_model="numpy", fastmath=FAST)


@jit
def whole(count):
    """Return the count rounded up to whole blocks."""
    return (count + BLOCK - 1) & -BLOCK


@jit
def _near(points, center, square, found, count, stop):
    """Keep, of the points found from `count` to `stop`, those in the ball; return how many there are then in all.

    Every point is written after those kept, and kept by advancing the count if it is near, which takes no branch.
    """
    cx, cy, cz = points[center, 0], points[center, 1], points[center, 2]
    for k in range(count, stop):
        j = found[k]
        x, y, z = points[j, 0] - cx, points[j, 1] - cy, points[j, 2] - cz
        found[count] = j
        count += ONE if x * x + y * y + z * z <= square else ZERO
    return count


@jit
def gathered(offsets, members, points, center, radius, stamps, stamp, found):
    """Fill `found` with the points connected to the center by edges in the ball, breadth first; return how many.

    Stops when `found` is full but for its last entry. The distances of a ring are tested when all of it is found.
    """
    square, mark = radius * radius, int32(stamp)
    stamps[center] = mark
    found[0] = center
    count, k, most = ONE, ZERO, uint64(found.shape[0] - 1)
    while k < count:
        ring = stop = count
        while k < ring:
            i = found[k]
            k += ONE
            for m in range(offsets[i], offsets[i + ONE]):
                j = members[m]
                found[stop] = j
                stop += ONE if stamps[j] != mark else ZERO  # kept as in `_near`
                stamps[j] = mark
                if stop == most:
                    stop = count = _near(points, center, square, found, count, stop)
                    if count == most:
                        return int64(count)
        count = _near(points, center, square, found, count, stop)
    return int64(count)


@jit
def collected(found, count, points, directions, around):
    """Write positions relative to the first point found, and directions, to the rows x y z and u v w of `around`."""
    center = found[0]
    cx, cy, cz = points[center, 0], points[center, 1], points[center, 2]
    for k in range(count):
        j = found[k]
        around[0, k], around[1, k], around[2, k] = points[j, 0] - cx, points[j, 1] - cy, points[j, 2] - cz
        around[3, k], around[4, k], around[5, k] = directions[j, 0], directions[j, 1], directions[j, 2]
    for k in range(count, whole(count)):
        for row in range(6):
            around[row, k] = 0.0


@jit
def shortened(radius, count):
    """Return the radius within which about `ENOUGH` of the points of a ball lie."""
    return radius if count <= ENOUGH else radius * math.sqrt(ENOUGH / count)


@jit
def leaning(around, count, radius, nx, ny, nz):
    """Return the tangential distance of the points' mean from the center, in radii: 0.42 on a straight border."""
    x = y = z = 0.0
    for k in range(whole(count)):
        x += around[0, k]
        y += around[1, k]
        z += around[2, k]
    height = nx * x + ny * y + nz * z
    return math.sqrt(max(x * x + y * y + z * z - height * height, 0.0)) / (count * radius)


@jit
def unit(x, y, z):
    """Return the unit vector of a vector, zero of zero."""
    length = math.sqrt(x * x + y * y + z * z)
    if length <= 1e-300:
        return 0.0, 0.0, 0.0
    return x / length, y / length, z / length


@jit
def mean_direction(around, count, oriented):
    """Return the unit mean of the points' directions that agree in side with the center's.

    Without orientation the others are reversed instead of left out.
    """
    sx = sy = sz = 0.0
    x, y, z = around[3, 0], around[4, 0], around[5, 0]
    reversed_share = 0.0 if oriented else -1.0
    for k in range(whole(count)):
        u, v, w = around[3, k], around[4, k], around[5, k]
        share = reversed_share if x * u + y * v + z * w < 0.0 else 1.0
        sx += share * u
        sy += share * v
        sz += share * w
    return unit(sx, sy, sz)


@jit
def seen(around, count, nx, ny, nz, oriented, radius, places):
    """Write the positions of the points to be fitted, relative to the center and in radii; return how many.

    Left out are points beyond the radius, points too steep above the plane, and points whose normal is reversed.
    The rest of the last block is zero, which adds nothing to any sum.
    """
    inverse = 1.0 / radius
    kept = 0
    for k in range(count):
        x, y, z = around[0, k] * inverse, around[1, k] * inverse, around[2, k] * inverse
        square = x * x + y * y + z * z
        height = nx * x + ny * y + nz * z
        along = nx * around[3, k] + ny * around[4, k] + nz * around[5, k]
        flat = (k == 0) | (height * height <= STEEP * square)
        places[0, kept], places[1, kept], places[2, kept] = x, y, z  # kept as in `_near`
        kept += (square <= 1.0) & flat & ((along >= 0.0) | (not oriented))
    for k in range(kept, whole(kept)):
        places[0, k] = places[1, k] = places[2, k] = 0.0
    return kept
