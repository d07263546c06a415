"""Kernels on the corners of the dual that decimation leaves: T7 where it bends nothing, and the vertices they make."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_batch import imbalance
from simplexmesh.mesh._kernels_decimate import Corners, Weights, shape
from simplexmesh.mesh._kernels_edit import DONE, EDITS, VERTICES, Darts, refuse_swap, turn, turn_edge
from simplexmesh.mesh._kernels_regions import cross

Array = NDArray[np.float64]


@njit(cache=True)
def stays(d: Darts, c: Corners, vertex: int) -> bool:
    """Return whether a vertex is on a hole, or on a face that must stay as it is."""
    out = False
    for dart in range(3 * vertex, 3 * vertex + 3):
        out |= d.face_hole[d.face[dart]] or c.reach[d.face[dart]] == 0
    return out


@njit(cache=True, error_model="numpy")
def bends(d: Darts, c: Corners, dart: int, w: Weights, n: Array) -> bool:
    """Return whether T7 on an edge turns a dual triangle too far from the two of before, or makes one too thin."""
    back = d.twin[dart]
    left, right = c.points[d.face[dart]], c.points[d.face[back]]
    near, far = c.points[d.face[turn(dart)]], c.points[d.face[turn(back)]]
    one, other = cross(left, far, near, n[0]), cross(right, near, far, n[1])
    two, three = cross(near, left, right, n[2]), cross(far, right, left, n[3])
    quality = min(shape(left, far, near, one), shape(right, near, far, other))
    if quality < w.shape and quality < min(shape(near, left, right, two), shape(far, right, left, three)):
        return True
    size = (one, other, two, three)
    for i in range(2):
        for j in range(2, 4):
            dot = n[i, 0] * n[j, 0] + n[i, 1] * n[j, 1] + n[i, 2] * n[j, 2]
            if not dot > w.turn * size[i] * size[j]:
                return True
    return False


@njit(cache=True)
def even_out_flat(d: Darts, c: Corners, w: Weights, passes: int) -> int:
    """T7 on unequal edges that bend nothing, where no vertex must stay, pass after pass; return how many were."""
    n = np.empty((4, 3))
    swaps = 0
    for _ in range(passes):
        before = swaps
        for dart in range(3 * d.used[VERTICES]):
            if not d.alive[dart // 3] or dart > d.twin[dart] or imbalance(d, dart) < 2:
                continue
            if stays(d, c, dart // 3) or stays(d, c, d.twin[dart] // 3):
                continue
            if refuse_swap(d, dart)[0] != DONE or bends(d, c, dart, w, n):
                continue
            turn_edge(d, dart)
            swaps += 1
        if swaps == before:
            break
    d.used[EDITS] = 0
    return swaps


@njit(cache=True)
def place_vertices(d: Darts, c: Corners) -> None:
    """Put each vertex at the centroid of its dual triangle, but for those on holes and on faces that must stay."""
    for i in range(d.used[VERTICES]):
        if not d.alive[i] or stays(d, c, i):
            continue
        for k in range(3):
            total = 0.0
            for j in range(3):
                total += c.points[d.face[3 * i + j], k]
            d.values[i, k] = total / 3
