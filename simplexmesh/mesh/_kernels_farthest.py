"""Kernels that certify whether triangles lie entirely within a distance of a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_triangle_tree import (
    STACK_SIZE,
    BoxTree,
    closest,
    closest_triangles,
    squared_to_triangle,
)
from simplexmesh.mesh._kernels_vectors import Vector, dot, minus, row

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CAPACITY = 256
"""Size of the stack of parts of a triangle, far above the depth of the bisection."""

FARTHER = 1.25
"""Once a point beyond the distance is found, only points farther by this factor are searched for."""

MAX_CUTS, MAX_CUTS_BEYOND = 2**16, 256
"""Maximum number of bisections of a triangle, and that once a point beyond the distance is found."""


@njit(cache=True, error_model="numpy")
def longest_side(p: Vector, q: Vector, r: Vector) -> tuple[int, float]:
    """Return the corner at which the longest side of a triangle starts, and its length."""
    pq, qr, rp = minus(p, q), minus(q, r), minus(r, p)
    one, two, three = dot(pq, pq), dot(qr, qr), dot(rp, rp)
    if one >= two and one >= three:
        return 0, np.sqrt(one)
    return (1, np.sqrt(two)) if two >= three else (2, np.sqrt(three))


@njit(cache=True, error_model="numpy")
def one_covers(b: BoxTree, p: Vector, q: Vector, r: Vector, candidates: Indices, squared: float) -> bool:
    """Return whether one of three triangles is near three points, and so near the whole triangle between them.

    The distance from a triangle, as from any convex set, is a convex function.
    """
    for t in candidates:
        largest = max(squared_to_triangle(b, t, p), squared_to_triangle(b, t, q), squared_to_triangle(b, t, r))
        if largest <= squared:
            return True
    return False


@njit(cache=True)
def set_corner(parts: Array, at: int, j: int, p: Vector) -> None:
    """Set corner `j` of the part at `at`."""
    for k in range(3):
        parts[at, j, k] = p[k]


@njit(cache=True, error_model="numpy")
def bisect(
    b: BoxTree, parts: Array, near: Indices, far: Array, size: int, start: int, stack: Indices
) -> tuple[Vector, float]:
    """Replace the part at `size` by its two halves, there and after it; return the new corner and its distance."""
    end = (start + 1) % 3
    x, y = row(parts[size], start), row(parts[size], end)
    m = ((x[0] + y[0]) / 2, (x[1] + y[1]) / 2, (x[2] + y[2]) / 2)
    found, squared = closest(b, m, near[size, start], stack)
    parts[size + 1], near[size + 1], far[size + 1] = parts[size], near[size], far[size]
    set_corner(parts, size, end, m)
    set_corner(parts, size + 1, start, m)
    near[size, end] = near[size + 1, start] = found
    far[size, end] = far[size + 1, start] = np.sqrt(squared)
    return m, np.sqrt(squared)


@njit(cache=True, error_model="numpy")
def farthest_points(
    b: BoxTree, points: Array, triangles: Indices, distance: float, smallest: float, out: Array, where: Array
) -> None:
    """Find the triangles beyond a distance of a surface, the approximate distance of each, and a point attaining it.

    `out` (t,) is 0 where a triangle is certainly within `distance`: it is bisected until every part is. A part is if
    one triangle of the surface is near all three of its corners, or if its corners are so near and the part so small
    that no point of it can be far: every point of a triangle is within (longest side) / sqrt(3) of a corner, and the
    distance function has Lipschitz constant 1. Parts smaller than `smallest` for which neither holds count as beyond,
    as does a triangle that would take too many bisections.
    """
    stack, parts = np.empty(STACK_SIZE, np.int64), np.empty((CAPACITY, 3, 3))
    near, far = np.empty((CAPACITY, 3), np.int64), np.empty((CAPACITY, 3))
    found, squared = np.empty(points.shape[0], np.int64), np.empty(points.shape[0])
    closest_triangles(b, points, found, squared)
    for t in range(triangles.shape[0]):
        out[t], bound = 0.0, distance
        for j in range(3):
            i = triangles[t, j]
            parts[0, j], near[0, j], far[0, j] = points[i], found[i], np.sqrt(squared[i])
            if far[0, j] > bound:
                out[t], where[t] = far[0, j], parts[0, j]
                bound = FARTHER * out[t]
        size, cuts = 1, 0
        while size:
            size -= 1
            if out[t] > 0 and cuts > MAX_CUTS_BEYOND:
                break
            p, q, r = row(parts[size], 0), row(parts[size], 1), row(parts[size], 2)
            start, length = longest_side(p, q, r)
            if far[size].max() + length / np.sqrt(3.0) <= bound or one_covers(b, p, q, r, near[size], bound**2):
                continue
            if length < smallest or cuts > MAX_CUTS or size + 2 > CAPACITY:
                if out[t] == 0:
                    out[t], where[t] = distance, parts[size, 0]
                continue
            cuts += 1
            m, apart = bisect(b, parts, near, far, size, start, stack)
            if apart > bound:
                out[t], where[t, 0], where[t, 1], where[t, 2] = apart, m[0], m[1], m[2]
                bound = FARTHER * apart
            size += 2
