"""Kernels of the editable mesh: the dart surgery of T1, T2 and T7, and the conditions for it.

A removed vertex keeps its darts and their twins, so that relinking its former neighbors restores it (dancing links).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base.arrays import Array, Indices, Indices32, Mask

REMOVE, INSERT, CUT, JOIN, REMOVE_FACE, REFINE_FACE, SWAP = range(1, 8)
DONE, TOUCHED, OPPOSITE_TRIANGLE, SHARED, SAME_EDGE, NO_FACE, BESIDE_TRIANGLE, SAME_OPPOSITE, NEIGHBORS = range(9)
HOLE, BESIDE_HOLE = 9, 10  # of T5 and T6
ON_CONTOUR = 11
VERTICES, FACES, EDITS = range(3)


class Darts(NamedTuple):
    """The arrays of an editable mesh, allocated with spare capacity; `used` has the lengths in use."""

    twin: Indices32  # (3c,) the opposite of each dart
    face: Indices32  # (3c,) the face on the left of each dart
    alive: Mask  # (c,) whether each vertex exists
    values: Array  # (c, k) position and other interpolated values
    origin: Indices32  # (c,) the original vertex from which the data that are not interpolated come
    face_dart: Indices32  # (g,) a dart of each face, -1 for removed faces
    face_size: Indices32  # (g,) the number of its vertices
    face_hole: Mask  # (g,) whether it is a hole
    contour: Indices32  # (3c,) the contour along each dart, see `paths.marked_darts`; of no length without contours
    log: Indices32  # (l, 6) operator, dart, side, face kept, face removed or new, hole labels of these two
    log_values: Array  # (l, 2, k) the values that a swap replaced
    used: Indices  # (3,) vertices, faces, edits


@njit(cache=True, _nrt=False)
def rotate(dart: int) -> int:
    """Return the next dart of the same vertex, counter-clockwise."""
    return dart + 1 if dart % 3 < 2 else dart - 2


@njit(cache=True, _nrt=False)
def next_dart(twin: Indices32, dart: int) -> int:
    """Return the next dart around the face on the left."""
    back = twin[dart]
    return back - 1 if back % 3 > 0 else back + 2


@njit(cache=True, _nrt=False)
def adjacent(d: Darts, one: int, other: int) -> bool:
    """Return whether two faces share an edge, in time proportional to the size of the smaller one."""
    if d.face_size[one] > d.face_size[other]:
        one, other = other, one
    start = d.face_dart[one]
    dart = start
    while True:
        if d.face[d.twin[dart]] == other:
            return True
        dart = next_dart(d.twin, dart)
        if dart == start:
            return False


@njit(cache=True, _nrt=False)
def refuse_remove(d: Darts, dart: int) -> tuple[int, int]:
    """Return the status of T1 on an edge and the face that makes it illegal, (DONE, -1) if it is legal."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    near, far = d.face[rotate(dart)], d.face[rotate(back)]
    if d.face_size[near] <= 3:
        return OPPOSITE_TRIANGLE, near
    if d.face_size[far] <= 3:
        return OPPOSITE_TRIANGLE, far
    start, other = dart, right
    if d.face_size[left] > d.face_size[right]:
        start, other = back, left
    walk = next_dart(d.twin, start)
    while walk != start:
        across = d.face[d.twin[walk]]
        if across != near and across != far and adjacent(d, across, other):
            return SHARED, across
        walk = next_dart(d.twin, walk)
    return DONE, -1


@njit(cache=True, _nrt=False)
def refuse_swap(d: Darts, dart: int) -> tuple[int, int]:
    """Return the status of T7 on an edge and the face that makes it illegal, (DONE, -1) if it is legal."""
    back = d.twin[dart]
    left, right = d.face[dart], d.face[back]
    near, far = d.face[rotate(dart)], d.face[rotate(back)]
    if d.face_size[left] <= 3:
        return BESIDE_TRIANGLE, left
    if d.face_size[right] <= 3:
        return BESIDE_TRIANGLE, right
    if near == far:
        return SAME_OPPOSITE, near
    if adjacent(d, near, far):
        return NEIGHBORS, near
    return DONE, -1


@njit(cache=True, _nrt=False)
def refuse_insert(d: Darts, one: int, other: int) -> tuple[int, int]:
    """Return the status of T2 on two edges and the face that makes it illegal, (DONE, -1) if it is legal."""
    if one == other:
        return SAME_EDGE, d.face[one]
    if d.face[one] != d.face[other]:
        return NO_FACE, d.face[other]
    return DONE, -1


@njit(cache=True, _nrt=False)
def unlink(d: Darts, dart: int, side: int) -> None:
    """Unlink an edge and its two ends; the face on its left (side 0) or right (side 1) merges into the other."""
    back = d.twin[dart]
    start = dart if side == 0 else back
    kept, gone = d.face[d.twin[start]], d.face[start]
    walk = start
    while True:
        d.face[walk] = kept
        walk = next_dart(d.twin, walk)
        if walk == start:
            break
    near, far = d.face[rotate(dart)], d.face[rotate(back)]
    for end in (np.int64(dart), np.int64(back)):
        one = d.twin[rotate(end)]
        other = d.twin[rotate(rotate(end))]
        d.twin[one] = other
        d.twin[other] = one
        d.alive[end // 3] = False
        d.face_dart[kept] = one
        d.face_dart[d.face[other]] = other
    d.face_size[kept] += d.face_size[gone] - 4
    d.face_size[near] -= 1
    d.face_size[far] -= 1
    d.face_dart[gone] = -1


@njit(cache=True, _nrt=False)
def relink(d: Darts, dart: int, side: int, kept: int, new: int) -> int:
    """Relink an edge into the face `kept`; its left (side 0), right (1) or smaller (-1) part becomes `new`."""
    back = d.twin[dart]
    for end in (np.int64(dart), np.int64(back)):
        one, other = rotate(end), rotate(rotate(end))
        d.twin[d.twin[one]] = one
        d.twin[d.twin[other]] = other
        d.alive[end // 3] = True
        opposite = d.face[d.twin[other]]
        d.face[one] = opposite
        d.face_size[opposite] += 1
        d.face[end] = kept
        d.face[other] = kept
    if side < 0:
        left, right = next_dart(d.twin, dart), next_dart(d.twin, back)
        while left != dart and right != back:
            left, right = next_dart(d.twin, left), next_dart(d.twin, right)
        side = 0 if left == dart else 1
    start = dart if side == 0 else back
    size = 0
    walk = start
    while True:
        d.face[walk] = new
        size += 1
        walk = next_dart(d.twin, walk)
        if walk == start:
            break
    d.face_dart[new] = start
    d.face_dart[kept] = d.twin[start]
    d.face_size[new] = size
    d.face_size[kept] += 4 - size
    return side


@njit(cache=True)
def record(d: Darts, kind: int, dart: int, side: int, kept: int, other: int, labels: int) -> None:
    """Append an edit to the log."""
    row = d.used[EDITS]
    d.log[row, 0], d.log[row, 1], d.log[row, 2] = kind, dart, side
    d.log[row, 3], d.log[row, 4], d.log[row, 5] = kept, other, labels
    d.used[EDITS] = row + 1


@njit(cache=True, _nrt=False)
def remove(d: Darts, dart: int) -> None:
    """T1: merge the two faces of an edge into the larger one, which becomes a hole if either is one."""
    left, right = d.face[dart], d.face[d.twin[dart]]
    side = 0 if d.face_size[left] < d.face_size[right] else 1
    kept, gone = (right, left) if side == 0 else (left, right)
    record(d, REMOVE, dart, side, kept, gone, d.face_hole[kept] + 2 * d.face_hole[gone])
    unlink(d, dart, side)
    d.face_hole[kept] |= d.face_hole[gone]


@njit(cache=True)
def insert(d: Darts, one: int, other: int, at: float, at_other: float, side: int) -> None:
    """T2: insert an edge between new vertices on two edges of the face on their left; `side` as in `relink`."""
    first = d.used[VERTICES]
    new = d.used[FACES]
    d.used[VERTICES] += 2
    d.used[FACES] += 1
    p, q = 3 * first, 3 * first + 3
    for vertex, dart, part in ((first, one, at), (first + 1, other, at_other)):
        start, end = dart // 3, d.twin[dart] // 3
        for k in range(d.values.shape[1]):
            d.values[vertex, k] = (1 - part) * d.values[start, k] + part * d.values[end, k]
        d.origin[vertex] = d.origin[start] if part <= 0.5 else d.origin[end]
        d.twin[3 * vertex] = d.twin[dart]
        d.twin[3 * vertex + 2] = dart
        if d.contour.size > 0:
            d.contour[3 * vertex], d.contour[3 * vertex + 1] = d.contour[dart], 0
            d.contour[3 * vertex + 2] = -d.contour[dart]
    d.twin[p + 1], d.twin[q + 1] = q + 1, p + 1
    kept = d.face[one]
    side = relink(d, p + 1, side, kept, new)
    d.face_hole[new] = d.face_hole[kept]
    record(d, INSERT, p + 1, side, kept, new, 0)


@njit(cache=True, _nrt=False)
def rotate_edge(d: Darts, dart: int) -> None:
    """T7 without logging: rotate an edge by a quarter turn, so that it separates the faces that were at its ends."""
    back = d.twin[dart]
    a, b = rotate(rotate(dart)), rotate(rotate(back))
    over, under = d.twin[b], d.twin[a]
    left, right = d.face[dart], d.face[back]
    near, far = d.face[rotate(dart)], d.face[rotate(back)]
    top, bottom = dart // 3, back // 3
    for k in range(d.values.shape[1]):
        middle = (d.values[top, k] + d.values[bottom, k]) / 4
        d.values[top, k] = middle + (d.values[d.twin[rotate(dart)] // 3, k] + d.values[over // 3, k]) / 4
        d.values[bottom, k] = middle + (d.values[d.twin[rotate(back)] // 3, k] + d.values[under // 3, k]) / 4
    d.twin[dart], d.twin[over] = over, dart
    d.twin[back], d.twin[under] = under, back
    d.twin[a], d.twin[b] = b, a
    d.face[a], d.face[b] = far, near
    d.face_dart[left], d.face_dart[right] = dart, back
    d.face_size[left] -= 1
    d.face_size[right] -= 1
    d.face_size[near] += 1
    d.face_size[far] += 1


@njit(cache=True)
def swap(d: Darts, dart: int) -> None:
    """T7: rotate an edge, and log the values of its ends."""
    row = d.used[EDITS]
    for k in range(d.values.shape[1]):
        d.log_values[row, 0, k] = d.values[dart // 3, k]
        d.log_values[row, 1, k] = d.values[d.twin[dart] // 3, k]
    record(d, SWAP, dart, 0, 0, 0, 0)
    rotate_edge(d, dart)


@njit(cache=True, _nrt=False)
def undo_swap(d: Darts, dart: int, row: int) -> None:
    """Undo the `swap` of a dart that is in `row` of the log."""
    a = rotate(rotate(dart))
    b = d.twin[a]
    back = rotate(b)
    over, under = d.twin[dart], d.twin[back]
    far, near = d.face[a], d.face[b]
    left, right = d.face[dart], d.face[back]
    d.twin[b], d.twin[over] = over, b
    d.twin[a], d.twin[under] = under, a
    d.twin[dart], d.twin[back] = back, dart
    d.face[a], d.face[b] = right, left
    d.face_dart[near], d.face_dart[far] = rotate(dart), rotate(back)
    d.face_size[left] += 1
    d.face_size[right] += 1
    d.face_size[near] -= 1
    d.face_size[far] -= 1
    for k in range(d.values.shape[1]):
        d.values[dart // 3, k] = d.log_values[row, 0, k]
        d.values[back // 3, k] = d.log_values[row, 1, k]
