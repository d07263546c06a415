"""Kernels that find crossing triangles: a uniform grid for candidate pairs, orientation determinants for the test."""

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import LEAN, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh.numerics._kernels_vectors import row

Triangle = tuple[int, int, int]

ROUNDING_BOUND = 8e-16
"""The sign of a determinant is certain above this times the sum of its absolute products (Shewchuk 1997)."""


@njit(**LEAN)
def _side(points: Array, a: int, b: int, c: int, d: int) -> int:
    """Return the side of the plane of a, b, c on which d lies: 1 below, -1 above, 0 if uncertain within rounding."""
    ax, ay, az = points[a, 0] - points[d, 0], points[a, 1] - points[d, 1], points[a, 2] - points[d, 2]
    bx, by, bz = points[b, 0] - points[d, 0], points[b, 1] - points[d, 1], points[b, 2] - points[d, 2]
    cx, cy, cz = points[c, 0] - points[d, 0], points[c, 1] - points[d, 1], points[c, 2] - points[d, 2]
    bc, cb, ca, ac, ab, ba = bx * cy, cx * by, cx * ay, ax * cy, ax * by, bx * ay
    det = az * (bc - cb) + bz * (ca - ac) + cz * (ab - ba)
    largest = (abs(bc) + abs(cb)) * abs(az) + (abs(ca) + abs(ac)) * abs(bz) + (abs(ab) + abs(ba)) * abs(cz)
    if det > ROUNDING_BOUND * largest:
        return 1
    if det < -ROUNDING_BOUND * largest:
        return -1
    return 0


@njit(**LEAN)
def _pierces(points: Array, p: int, q: int, a: int, b: int, c: int) -> bool:
    """Return whether segment p, q crosses triangle a, b, c from one side to the other."""
    if _side(points, a, b, c, p) * _side(points, a, b, c, q) != -1:
        return False
    ab, bc, ca = _side(points, p, q, a, b), _side(points, p, q, b, c), _side(points, p, q, c, a)
    least, largest = min(ab, bc, ca), max(ab, bc, ca)
    return least * largest >= 0 and largest - least + abs(largest) > 0


@njit(cache=True, error_model="numpy", _nrt=False)
def triangles_cross(points: Array, s: Triangle, t: Triangle) -> bool:
    """Return whether two triangles, given by their corners, cross other than in a shared corner or edge."""
    shared = 0
    in_s, in_t = 0, 0
    for i in range(3):
        for j in range(3):
            if s[i] == t[j]:
                shared += 1
                in_s, in_t = i, j
    if shared > 1:
        return False
    for i in range(3):
        if (shared == 0 or i == in_s) and _pierces(points, s[(i + 1) % 3], s[(i + 2) % 3], t[0], t[1], t[2]):
            return True
        if (shared == 0 or i == in_t) and _pierces(points, t[(i + 1) % 3], t[(i + 2) % 3], s[0], s[1], s[2]):
            return True
    return False


@njit(cache=True, error_model="numpy")
def boxes_by_cell(
    low: Array, high: Array, origin: Array, cell: float, shape: Indices
) -> tuple[Indices, Indices, Indices]:
    """Return the boxes that meet each cell, as offsets and boxes (CSR), and the first and last cell of each box."""
    n = low.shape[0]
    span = np.empty((n, 2, 3), np.int64)
    offsets = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    for fill in range(2):
        if fill:
            before = 0
            for at in range(offsets.size):
                offsets[at], before = before, before + offsets[at]
            boxes = np.empty(offsets[-1], np.int64)
            cursor = offsets[:-1].copy()
        else:
            boxes = np.empty(0, np.int64)
            cursor = offsets
        for t in range(n):
            for k in range(3):
                span[t, 0, k] = min(int((low[t, k] - origin[k]) / cell), shape[k] - 1)
                span[t, 1, k] = min(int((high[t, k] - origin[k]) / cell), shape[k] - 1)
            for x in range(span[t, 0, 0], span[t, 1, 0] + 1):
                for y in range(span[t, 0, 1], span[t, 1, 1] + 1):
                    for z in range(span[t, 0, 2], span[t, 1, 2] + 1):
                        at = (x * shape[1] + y) * shape[2] + z
                        if fill:
                            boxes[cursor[at]] = t
                        cursor[at] += 1
    return offsets, boxes, span


@njit(**LEAN)
def _overlap(low: Array, high: Array, s: int, t: int) -> bool:
    """Return whether two boxes overlap."""
    return (
        low[s, 0] <= high[t, 0]
        and low[t, 0] <= high[s, 0]
        and low[s, 1] <= high[t, 1]
        and low[t, 1] <= high[s, 1]
        and low[s, 2] <= high[t, 2]
        and low[t, 2] <= high[s, 2]
    )


@njit(cache=True, error_model="numpy")
def overlapping_boxes(low: Array, high: Array, origin: Array, cell: float, shape: Indices) -> Indices:
    """Return the pairs (m, 2) of overlapping boxes, each found in the first cell shared, the smaller index first."""
    offsets, boxes, span = boxes_by_cell(low, high, origin, cell, shape)
    out = np.empty((8 * low.shape[0] + 64, 2), np.int64)
    found = 0
    for at in range(offsets.size - 1):
        x, y, z = at // (shape[1] * shape[2]), at // shape[2] % shape[1], at % shape[2]
        for i in range(offsets[at], offsets[at + 1]):
            s = boxes[i]
            for j in range(i + 1, offsets[at + 1]):
                t = boxes[j]
                if (
                    not _overlap(low, high, s, t)
                    or max(span[s, 0, 0], span[t, 0, 0]) != x
                    or max(span[s, 0, 1], span[t, 0, 1]) != y
                    or max(span[s, 0, 2], span[t, 0, 2]) != z
                ):
                    continue
                if found == out.shape[0]:
                    out = np.concatenate((out, np.empty_like(out)))
                out[found, 0], out[found, 1] = min(s, t), max(s, t)
                found += 1
    return out[:found].copy()


@njit(cache=True, error_model="numpy", _nrt=False)
def _fans_cross(points: Array, triangles: Indices, starts: Indices, low: Array, high: Array, s: int, t: int) -> bool:
    """Return whether two fans cross, or one itself, of the triangles from `starts[s]` and `starts[t]` on."""
    for i in range(starts[s], starts[s + 1]):
        for j in range(i + 1 if s == t else starts[t], starts[t + 1]):
            if _overlap(low, high, i, j) and triangles_cross(points, row(triangles, i), row(triangles, j)):
                return True
    return False


@by_rows(1000)
def are_crossing_fans(
    begin: int, end: int, points: Array, triangles: Indices, starts: Indices, boxes: tuple[Array, Array],
    pairs: Indices, out: Mask,
) -> None:  # fmt: skip
    """Fill which pairs (m, 2) of fans cross, or single ones themselves; `boxes` bound their triangles, low and high."""
    low, high = boxes
    for k in range(begin, end):
        out[k] = _fans_cross(points, triangles, starts, low, high, pairs[k, 0], pairs[k, 1])
