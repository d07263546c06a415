"""Kernels that reduce the faces with fewer than five or more than seven vertices, by short sequences of T7."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_corners import is_fixed, swap_degrades
from simplexmesh.mesh._kernels_decimate import Corners, Weights
from simplexmesh.mesh._kernels_edit import DONE, EDITS, Darts, next_dart, refuse_swap, rotate, swap, undo_swap

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

MIN_SIZE, MAX_SIZE = 5, 7
"""Smallest and largest size of a face that is not exceptional."""

MAX_INCREASE = 1
"""Largest increase of the excess within a sequence of swaps."""


@njit(cache=True)
def excess(d: Darts, face: int) -> int:
    """Return the number of vertices by which a face is too small or too large; 0 for holes."""
    if d.face_hole[face]:
        return 0
    return max(MIN_SIZE - d.face_size[face], d.face_size[face] - MAX_SIZE, 0)


@njit(cache=True)
def total_excess(d: Darts, faces: tuple[int, int, int, int]) -> int:
    """Return the sum of the excess of four faces."""
    return excess(d, faces[0]) + excess(d, faces[1]) + excess(d, faces[2]) + excess(d, faces[3])


@njit(cache=True)
def may_swap(d: Darts, c: Corners, dart: int, w: Weights, n: Array) -> bool:
    """Return whether T7 on an edge is legal, changes nothing that is fixed, and keeps the shape of the dual."""
    if is_fixed(d, c, dart // 3) or is_fixed(d, c, d.twin[dart] // 3):
        return False
    return refuse_swap(d, dart)[0] == DONE and not swap_degrades(d, c, dart, w, n)


class Search(NamedTuple):
    """State of a depth-first search over sequences of swaps, each beside a face touched by the previous ones."""

    touched: Indices  # the faces touched so far
    counts: NDArray[np.int64]  # their number before each swap
    change: NDArray[np.int64]  # increase of the excess before each swap
    cursor: NDArray[np.int64]  # (steps, 3) candidate of each level: number of a touched face, of an edge there, dart
    swapped: NDArray[np.int64]  # the dart swapped at each level


@njit(cache=True)
def new_search(steps: int) -> Search:
    """Return a search over sequences of up to `steps` swaps."""
    i = np.int64
    return Search(
        np.empty(4 * steps + 1, np.int32),
        np.ones(steps + 1, i),
        np.zeros(steps + 1, i),
        np.zeros((steps, 3), i),
        np.empty(steps, i),
    )


@njit(cache=True)
def next_edge(d: Darts, s: Search, level: int) -> int:
    """Return the next edge whose swap reduces the excess of a touched face, -1 after the last."""
    cursor = s.cursor[level]
    while cursor[0] < s.counts[level]:
        face = s.touched[cursor[0]]
        if cursor[1] == 0:
            cursor[2] = d.face_dart[face]
        if excess(d, face) > 0 and cursor[1] < d.face_size[face]:
            dart = cursor[2]
            cursor[1] += 1
            cursor[2] = next_dart(d.twin, dart)
            return dart if d.face_size[face] > MAX_SIZE else rotate(rotate(dart))
        cursor[0] += 1
        cursor[1] = 0
    return -1


@njit(cache=True)
def apply_swap(d: Darts, s: Search, dart: int, level: int) -> int:
    """Apply T7, record the faces touched, and return the increase of the excess since before the first swap."""
    four = (d.face[dart], d.face[d.twin[dart]], d.face[rotate(dart)], d.face[rotate(d.twin[dart])])
    change = s.change[level] - total_excess(d, four)
    swap(d, dart)
    change += total_excess(d, four)
    count = s.counts[level]
    for f in four:
        if not (s.touched[:count] == f).any():
            s.touched[count] = f
            count += 1
    s.swapped[level], s.counts[level + 1], s.change[level + 1] = dart, count, change
    return change


@njit(cache=True)
def reduce_excess(d: Darts, c: Corners, w: Weights, face: int, steps: int, s: Search, n: Array) -> bool:
    """Apply up to `steps` swaps that reduce the total excess of a face and those touched; none if impossible."""
    level = 0
    s.touched[0] = face
    s.cursor[:] = 0
    while level >= 0:
        dart = next_edge(d, s, level)
        if dart >= 0:
            if not may_swap(d, c, dart, w, n):
                continue
            change = apply_swap(d, s, dart, level)
            if change < 0:
                return True
            if level + 1 < steps and change <= MAX_INCREASE:
                level += 1
                s.cursor[level] = 0
                continue
        else:
            level -= 1
        if level >= 0:
            undo_swap(d, s.swapped[level], level)
            d.used[EDITS] = level
    return False


@njit(cache=True)
def reduce_exceptions(d: Darts, c: Corners, w: Weights, steps: int) -> int:
    """Reduce the excess of all faces by sequences of up to `steps` swaps, the shortest first; return what is left.

    Components of fewer than `w.min_component` vertices are skipped: small meshes need faces of other sizes.
    """
    steps = min(steps, d.log.shape[0])
    n, s = np.empty((4, 3)), new_search(steps)
    left, before = 0, -1
    while left != before:
        before, left = left, 0
        for f in range(d.face_dart.size):
            if d.face_dart[f] < 0 or c.n_left[c.component[d.face_dart[f] // 3]] < w.min_component:
                continue
            length = 1
            while length <= steps and excess(d, f) > 0:
                d.used[EDITS] = 0
                length = 1 if reduce_excess(d, c, w, f, length, s, n) else length + 1
            left += excess(d, f)
    d.used[EDITS] = 0
    return left
