"""Kernels on the corners of the dual that decimation leaves: T7 where it bends nothing, and the vertices they make."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from simplexmesh.mesh._kernels_batch import imbalance
from simplexmesh.mesh._kernels_decimate import Corners, Weights, shape
from simplexmesh.mesh._kernels_edit import DONE, EDITS, VERTICES, Darts, refuse_swap, turn, turn_edge
from simplexmesh.mesh._kernels_quadrics import cross, holes_around

Array = NDArray[np.float64]


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
    """T7 on unequal edges that bend nothing and are away from holes, pass after pass; return how many were."""
    n = np.empty((4, 3))
    swaps = 0
    for _ in range(passes):
        before = swaps
        for dart in range(3 * d.used[VERTICES]):
            if not d.alive[dart // 3] or dart > d.twin[dart] or imbalance(d, dart) < 2:
                continue
            back = d.twin[dart]
            if d.face_hole[d.face[turn(dart)]] or d.face_hole[d.face[turn(back)]]:
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
def place_vertices(d: Darts, c: Corners, origin: Array) -> None:
    """Put each vertex at the centroid of its dual triangle, on a rim at the middle of its edge of the border."""
    for i in range(d.used[VERTICES]):
        holes = holes_around(d.face, d.face_hole, i)
        if not d.alive[i] or holes > 1:
            continue
        for k in range(3):
            total = 0.0
            for j in range(3):
                if not d.face_hole[d.face[3 * i + j]]:
                    total += c.points[d.face[3 * i + j], k]
            d.values[i, k] = origin[k] + total / (3 - holes)
