"""Kernels that rid a decimated mesh of faces outside five to seven vertices, by T7 along short paths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_corners import bends, stays
from simplexmesh.mesh._kernels_decimate import Corners, Weights
from simplexmesh.mesh._kernels_edit import DONE, EDITS, Darts, follow, refuse_swap, swap, turn, turn_back

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

LEAST, MOST = 5, 7
"""Faces of so many vertices are no exceptions."""

DETOUR = 1
"""How much more excess there may be on the way."""


@njit(cache=True)
def excess(d: Darts, face: int) -> int:
    """Return how many vertices a face has too few or too many; 0 for holes."""
    if d.face_hole[face]:
        return 0
    return max(LEAST - d.face_size[face], d.face_size[face] - MOST, 0)


@njit(cache=True)
def total_excess(d: Darts, faces: tuple[int, int, int, int]) -> int:
    """Return how many vertices four faces have too few or too many."""
    return excess(d, faces[0]) + excess(d, faces[1]) + excess(d, faces[2]) + excess(d, faces[3])


@njit(cache=True)
def may_swap(d: Darts, c: Corners, dart: int, w: Weights, n: Array) -> bool:
    """Return whether T7 on an edge is legal, moves nothing that must stay, and bends nothing."""
    if stays(d, c, dart // 3) or stays(d, c, d.twin[dart] // 3):
        return False
    return refuse_swap(d, dart)[0] == DONE and not bends(d, c, dart, w, n)


class Search(NamedTuple):
    """Swaps that are tried one after another, each of an edge of a face that those before it touched."""

    touched: Indices  # the faces touched so far
    counts: NDArray[np.int64]  # how many of them there were before each swap
    change: NDArray[np.int64]  # how much more excess there was
    place: NDArray[np.int64]  # (steps, 3) where each looks: number of a touched face, of an edge there, dart
    swapped: NDArray[np.int64]  # the dart of each


@njit(cache=True)
def new_search(steps: int) -> Search:
    """Return room for so many swaps."""
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
    """Return the next edge whose swap makes an exception less of one, -1 after the last."""
    place = s.place[level]
    while place[0] < s.counts[level]:
        face = s.touched[place[0]]
        if place[1] == 0:
            place[2] = d.face_dart[face]
        if excess(d, face) > 0 and place[1] < d.face_size[face]:
            dart = place[2]
            place[1] += 1
            place[2] = follow(d.twin, dart)
            return dart if d.face_size[face] > MOST else turn(turn(dart))
        place[0] += 1
        place[1] = 0
    return -1


@njit(cache=True)
def swap_on(d: Darts, s: Search, dart: int, level: int) -> int:
    """T7; note the faces touched, and return how much more excess there is than before the first swap."""
    four = (d.face[dart], d.face[d.twin[dart]], d.face[turn(dart)], d.face[turn(d.twin[dart])])
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
def lessen(d: Darts, c: Corners, w: Weights, face: int, steps: int, s: Search, n: Array) -> bool:
    """T7 up to so many times until a face and those touched have less excess; none when that cannot be."""
    level = 0
    s.touched[0] = face
    s.place[:] = 0
    while level >= 0:
        dart = next_edge(d, s, level)
        if dart >= 0:
            if not may_swap(d, c, dart, w, n):
                continue
            change = swap_on(d, s, dart, level)
            if change < 0:
                return True
            if level + 1 < steps and change <= DETOUR:
                level += 1
                s.place[level] = 0
                continue
        else:
            level -= 1
        if level >= 0:
            turn_back(d, s.swapped[level], level)
            d.used[EDITS] = level
    return False


@njit(cache=True)
def lessen_exceptions(d: Darts, c: Corners, w: Weights, steps: int) -> int:
    """T7 along paths of up to so many steps, the shortest first, each of which leaves less excess; return what is left.

    Components of fewer than `w.piece` vertices are left out: they have no room.
    """
    steps = min(steps, d.log.shape[0])
    n, s = np.empty((4, 3)), new_search(steps)
    left, before = 0, -1
    while left != before:
        before, left = left, 0
        for f in range(d.face_dart.size):
            if d.face_dart[f] < 0 or c.left[c.component[d.face_dart[f] // 3]] < w.piece:
                continue
            most = 1
            while most <= steps and excess(d, f) > 0:
                d.used[EDITS] = 0
                most = 1 if lessen(d, c, w, f, most, s, n) else most + 1
            left += excess(d, f)
    d.used[EDITS] = 0
    return left
