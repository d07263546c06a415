"""Kernels of an axis-aligned bounding-box tree of triangles: closest triangles and points.

The boxes are a complete binary tree stored as an array with the root at 1, the children of box i at 2 i and 2 i + 1.
Each leaf holds `LEAF` consecutive triangles of an order that keeps neighbors together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_fitting import closest_on_triangle
from simplexmesh.mesh._kernels_vectors import Vector, row

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LEAF = 4
STACK_SIZE = 64


class BoxTree(NamedTuple):
    """Triangles and their bounding boxes."""

    points: Array  # (v, 3)
    triangles: Indices  # (t, 3) in the order of the leaves
    box: Array  # (2 m, 2, 3) lower and upper corners; inf and -inf for empty boxes


@njit(cache=True)
def morton_codes(cells: Indices) -> Indices:
    """Return the Morton codes (t,) of cells (t, 3) with coordinates of up to 20 bits (G. M. Morton, 1966)."""
    out = np.zeros(cells.shape[0], np.int64)
    for i in range(out.size):
        for bit in range(20):
            for k in range(3):
                out[i] |= ((cells[i, k] >> bit) & 1) << (3 * bit + k)
    return out


@njit(cache=True, error_model="numpy")
def fit_boxes(b: BoxTree) -> None:
    """Compute all boxes, bottom up."""
    m = b.box.shape[0] // 2
    b.box[:, 0], b.box[:, 1] = np.inf, -np.inf
    for t in range(b.triangles.shape[0]):
        box = b.box[m + t // LEAF]
        for j in range(3):
            for k in range(3):
                x = b.points[b.triangles[t, j], k]
                box[0, k], box[1, k] = min(box[0, k], x), max(box[1, k], x)
    for i in range(m - 1, 0, -1):
        for k in range(3):
            b.box[i, 0, k] = min(b.box[2 * i, 0, k], b.box[2 * i + 1, 0, k])
            b.box[i, 1, k] = max(b.box[2 * i, 1, k], b.box[2 * i + 1, 1, k])


@njit(cache=True, error_model="numpy")
def squared_to_box(box: Array, p: Vector) -> float:
    """Return the squared distance of a point from a box."""
    total = 0.0
    for k in range(3):
        off = max(box[0, k] - p[k], p[k] - box[1, k], 0.0)
        total += off * off
    return total


@njit(cache=True, error_model="numpy")
def squared_to_triangle(b: BoxTree, t: int, p: Vector) -> float:
    """Return the squared distance of a point from a triangle."""
    i, j, k = b.triangles[t]
    return closest_on_triangle(p, row(b.points, i), row(b.points, j), row(b.points, k))[0]


@njit(cache=True, error_model="numpy")
def closest(b: BoxTree, p: Vector, guess: int, stack: Indices) -> tuple[int, float]:
    """Return the closest triangle of a point and its squared distance, from a guess on; `stack` is a workspace."""
    found, best = guess, squared_to_triangle(b, guess, p)
    m = b.box.shape[0] // 2
    stack[0], size = 1, 1
    while size:
        size -= 1
        i = stack[size]
        if not squared_to_box(b.box[i], p) < best:
            continue
        if i >= m:
            for t in range((i - m) * LEAF, min((i - m + 1) * LEAF, b.triangles.shape[0])):
                squared = squared_to_triangle(b, t, p)
                if squared < best:
                    found, best = t, squared
            continue
        near, far = 2 * i, 2 * i + 1
        if squared_to_box(b.box[near], p) > squared_to_box(b.box[far], p):
            near, far = far, near
        stack[size], stack[size + 1] = far, near
        size += 2
    return found, best


@njit(cache=True, error_model="numpy")
def closest_triangles(b: BoxTree, points: Array, found: Indices, squared: Array) -> None:
    """Find the closest triangle of each point, numbered as in the tree, and its squared distance."""
    stack = np.empty(STACK_SIZE, np.int64)
    guess = np.int64(0)
    for i in range(points.shape[0]):
        guess, squared[i] = closest(b, row(points, i), guess, stack)
        found[i] = guess


@njit(cache=True, error_model="numpy")
def closest_points(b: BoxTree, points: Array, found: Indices, weights: Array, squared: Array) -> None:
    """Find closest triangles as `closest_triangles`, and the barycentric coordinates (p, 3) of the closest points."""
    closest_triangles(b, points, found, squared)
    for i in range(points.shape[0]):
        one, two, three = b.triangles[found[i]]
        corners = row(b.points, one), row(b.points, two), row(b.points, three)
        _, v, w = closest_on_triangle(row(points, i), corners[0], corners[1], corners[2])
        weights[i, 0], weights[i, 1], weights[i, 2] = 1 - v - w, v, w
