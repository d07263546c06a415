"""Kernels that tell for certain whether triangles are within a distance of a surface, everywhere on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_boxes import DEEP, Boxes, closest, closest_triangles, from_triangle
from simplexmesh.mesh._kernels_vectors import Vector, dot, minus, row

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

ROOM = 256
"""How many parts of a triangle can wait: far more than are cut on the way down to the smallest."""

FARTHER = 1.25
"""Once a point is found beyond the distance, only points so much farther are still looked for."""

CUTS, MORE = 2**16, 256
"""How often a triangle is cut at most, and how often once a point is found beyond the distance."""


@njit(cache=True, error_model="numpy")
def longest_side(p: Vector, q: Vector, r: Vector) -> tuple[int, float]:
    """Return the corner from which the longest side of a triangle starts, and the length of that side."""
    pq, qr, rp = minus(p, q), minus(q, r), minus(r, p)
    one, two, three = dot(pq, pq), dot(qr, qr), dot(rp, rp)
    if one >= two and one >= three:
        return 0, np.sqrt(one)
    return (1, np.sqrt(two)) if two >= three else (2, np.sqrt(three))


@njit(cache=True, error_model="numpy")
def one_is_near(b: Boxes, p: Vector, q: Vector, r: Vector, near: Indices, squared: float) -> bool:
    """Return whether one of three triangles is near three points: then it is near everything between them.

    The distance from a triangle, as from any convex set, is a convex function.
    """
    for t in near:
        most = max(from_triangle(b, t, p), from_triangle(b, t, q), from_triangle(b, t, r))
        if most <= squared:
            return True
    return False


@njit(cache=True)
def put(room: Array, at: int, j: int, p: Vector) -> None:
    """Put a corner of a part where it waits."""
    for k in range(3):
        room[at, j, k] = p[k]


@njit(cache=True, error_model="numpy")
def halve(
    b: Boxes, room: Array, near: Indices, far: Array, size: int, start: int, stack: Indices
) -> tuple[Vector, float]:
    """Put the two halves of the part at `size` there and after it; return where it was cut, and how far that is."""
    end = (start + 1) % 3
    x, y = row(room[size], start), row(room[size], end)
    m = ((x[0] + y[0]) / 2, (x[1] + y[1]) / 2, (x[2] + y[2]) / 2)
    found, squared = closest(b, m, near[size, start], stack)
    room[size + 1], near[size + 1], far[size + 1] = room[size], near[size], far[size]
    put(room, size, end, m)
    put(room, size + 1, start, m)
    near[size, end] = near[size + 1, start] = found
    far[size, end] = far[size + 1, start] = np.sqrt(squared)
    return m, np.sqrt(squared)


@njit(cache=True, error_model="numpy")
def farthest_points(
    b: Boxes, points: Array, triangles: Indices, distance: float, least: float, out: Array, where: Array
) -> None:
    """Find which triangles are farther from a surface than a distance, about how far, and at which of their points.

    `out` (t,) is 0 where a triangle is within `distance` for certain: it is cut in halves until each part is. A part is
    when one triangle of the surface is near all three corners; or when the corners are so near and the part so small
    that nothing on it can be far: no point of a triangle is farther from all corners than the longest side by the
    square root of 3, and a distance changes by no more than the point moves. Parts smaller than `least` of which
    neither can be told count as beyond, and so does what would take too many cuts.
    """
    stack, room = np.empty(DEEP, np.int64), np.empty((ROOM, 3, 3))
    near, far = np.empty((ROOM, 3), np.int64), np.empty((ROOM, 3))
    found, squared = np.empty(points.shape[0], np.int64), np.empty(points.shape[0])
    closest_triangles(b, points, found, squared)
    for t in range(triangles.shape[0]):
        out[t], most = 0.0, distance
        for j in range(3):
            i = triangles[t, j]
            room[0, j], near[0, j], far[0, j] = points[i], found[i], np.sqrt(squared[i])
            if far[0, j] > most:
                out[t], where[t] = far[0, j], room[0, j]
                most = FARTHER * out[t]
        size, cuts = 1, 0
        while size:
            size -= 1
            if out[t] > 0 and cuts > MORE:
                break
            p, q, r = row(room[size], 0), row(room[size], 1), row(room[size], 2)
            start, length = longest_side(p, q, r)
            if far[size].max() + length / np.sqrt(3.0) <= most or one_is_near(b, p, q, r, near[size], most**2):
                continue
            if length < least or cuts > CUTS or size + 2 > ROOM:
                if out[t] == 0:
                    out[t], where[t] = distance, room[size, 0]
                continue
            cuts += 1
            m, apart = halve(b, room, near, far, size, start, stack)
            if apart > most:
                out[t], where[t, 0], where[t, 1], where[t, 2] = apart, m[0], m[1], m[2]
                most = FARTHER * apart
            size += 2
