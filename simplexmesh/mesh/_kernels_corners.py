"""Kernels on the dual triangulation of a decimated mesh: edge swaps (T7) that keep its shape, and vertex placement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_batch import imbalance
from simplexmesh.mesh._kernels_decimate import Corners, Weights, triangle_quality
from simplexmesh.mesh._kernels_edit import DONE, EDITS, VERTICES, Darts, refuse_swap, rotate, rotate_edge
from simplexmesh.mesh._kernels_regions import cross

Array = NDArray[np.float64]


@njit(cache=True)
def is_fixed(d: Darts, c: Corners, vertex: int) -> bool:
    """Return whether a vertex is on a hole or on a fixed face."""
    out = False
    for dart in range(3 * vertex, 3 * vertex + 3):
        out |= d.face_hole[d.face[dart]] or c.max_extent[d.face[dart]] == 0
    return out


@njit(cache=True, error_model="numpy")
def swap_degrades(d: Darts, c: Corners, dart: int, w: Weights, n: Array) -> bool:
    """Return whether T7 rotates a dual triangle too far or makes one too thin; `n` (4, 3) is a workspace."""
    back = d.twin[dart]
    left, right = c.points[d.face[dart]], c.points[d.face[back]]
    near, far = c.points[d.face[rotate(dart)]], c.points[d.face[rotate(back)]]
    one, other = cross(left, far, near, n[0]), cross(right, near, far, n[1])
    two, three = cross(near, left, right, n[2]), cross(far, right, left, n[3])
    quality = min(triangle_quality(left, far, near, one), triangle_quality(right, near, far, other))
    if quality < w.quality and quality < min(
        triangle_quality(near, left, right, two), triangle_quality(far, right, left, three)
    ):
        return True
    size = (one, other, two, three)
    for i in range(2):
        for j in range(2, 4):
            dot = n[i, 0] * n[j, 0] + n[i, 1] * n[j, 1] + n[i, 2] * n[j, 2]
            if not dot > w.turn * size[i] * size[j]:
                return True
    return False


@njit(cache=True)
def swap_unequal(d: Darts, c: Corners, w: Weights, passes: int) -> int:
    """Apply T7 to imbalanced edges where it is allowed, in passes over all edges; return the number of swaps."""
    n = np.empty((4, 3))
    swaps = 0
    for _ in range(passes):
        before = swaps
        for dart in range(3 * d.used[VERTICES]):
            if not d.alive[dart // 3] or dart > d.twin[dart] or imbalance(d, dart) < 2:
                continue
            if is_fixed(d, c, dart // 3) or is_fixed(d, c, d.twin[dart] // 3):
                continue
            if refuse_swap(d, dart)[0] != DONE or swap_degrades(d, c, dart, w, n):
                continue
            rotate_edge(d, dart)
            swaps += 1
        if swaps == before:
            break
    d.used[EDITS] = 0
    return swaps


@njit(cache=True)
def place_vertices(d: Darts, c: Corners) -> None:
    """Place each vertex that is not fixed at the centroid of its dual triangle."""
    for i in range(d.used[VERTICES]):
        if not d.alive[i] or is_fixed(d, c, i):
            continue
        for k in range(3):
            total = 0.0
            for j in range(3):
                total += c.points[d.face[3 * i + j], k]
            d.values[i, k] = total / 3
