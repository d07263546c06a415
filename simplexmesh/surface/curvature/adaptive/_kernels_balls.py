"""Balls of points around a center: gathering along edges, which side they lie on, which of them are to be fitted."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import int32, int64, uint64
from numpy.typing import NDArray

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base.arrays import Array, Mask

CAPACITY, ENOUGH = 352, 245
"""Most points gathered; balls of more than enough are shortened to hold about that many, for speed."""

STEEP = 0.64
"""Points whose height above the tangent plane exceeds 0.8 of their distance are left out; squared."""

BLOCK = 32
"""Loops over points run to a multiple of this, a whole number of vector registers; zeros follow the last point."""

ZERO, ONE = np.uint64(0), np.uint64(1)
"""Indices are unsigned: numba tests signed ones for negative values, which costs a sixth of the time of gathering."""

jit = njit(cache=True, error_model="numpy", fastmath=FAST)

inlined = njit(cache=True, error_model="numpy", fastmath=FAST, inline="always")
"""For links of a chain of calls: numba would compile all that follows again at each."""


class Surface(NamedTuple):
    """What balls are gathered from: one-rings in CSR form, unsigned; points; rough normals, and if they have a side."""

    offsets: NDArray[np.uint64]
    members: NDArray[np.uint64]
    closed: Mask
    points: Array
    directions: Array
    oriented: bool


@jit
def whole(count):
    """Return the count rounded up to whole blocks."""
    return (count + BLOCK - 1) & -BLOCK


@jit
def _near(points, center, square, found, count, stop):
    """Keep, of the points found from `count` to `stop`, those in the ball, without a branch; return how many in all."""
    cx, cy, cz = points[center, 0], points[center, 1], points[center, 2]
    for k in range(count, stop):
        j = found[k]
        x, y, z = points[j, 0] - cx, points[j, 1] - cy, points[j, 2] - cz
        found[count] = j
        count += ONE if x * x + y * y + z * z <= square else ZERO
    return count


@jit
def gathered(surface, center, radius, stamps, stamp, found):
    """Fill `found` with the points connected to the center in the ball, breadth first, until full; return how many."""
    offsets, members, points = surface.offsets, surface.members, surface.points
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
def collected(found, count, surface, around):
    """Write positions relative to the first point found, and directions, to the rows x y z and u v w of `around`."""
    center, points, directions = found[0], surface.points, surface.directions
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
def leaning(around, count, radius, normal):
    """Return the tangential distance of the points' mean from the center, in radii: 0.42 on a straight border."""
    x = y = z = 0.0
    for k in range(whole(count)):
        x += around[0, k]
        y += around[1, k]
        z += around[2, k]
    height = normal[0] * x + normal[1] * y + normal[2] * z
    return math.sqrt(max(x * x + y * y + z * z - height * height, 0.0)) / (count * radius)


@jit
def reaches_border(found, count, closed):
    """Return whether one of the points found has an open ring; in clouds all have."""
    border = False
    for k in range(count):
        border |= not closed[found[k]]
    return border


@jit
def unit(x, y, z):
    """Return the unit vector of a vector, zero of zero."""
    length = math.sqrt(x * x + y * y + z * z)
    if length <= 1e-300:
        return 0.0, 0.0, 0.0
    return x / length, y / length, z / length


@jit
def mean_direction(around, count, oriented):
    """Return the unit mean of the points' directions on the center's side; unoriented ones are reversed to it."""
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
def seen(around, count, normal, oriented, radius, places):
    """Write the positions of points in the radius, not too steep and not reversed, in radii; return how many."""
    inverse, kept = 1.0 / radius, 0
    nx, ny, nz = normal
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
