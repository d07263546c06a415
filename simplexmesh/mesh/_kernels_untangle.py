"""Kernels that look for better places of vertices on faces that fold or cross, and for faces that may cross."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_crossing import boxes_by_cell
from simplexmesh.mesh._kernels_fans import Guarded, crossings, touches_crossed
from simplexmesh.mesh._kernels_guard import EQUAL, MANY, Bounds, faults, put_vertex

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

CROSSING = 0.5
"""What a pair of triangles that cross counts."""

PLACES = 14
LARGE_STEP, SMALL_STEP = 0.3, 0.1

WORTH = 0.02
"""How much less wrong something must get somewhere for another pass."""


@njit(cache=True, error_model="numpy")
def place_to_try(g: Guarded, i: int, which: int, start: Array, best: Array, size: float, out: Array) -> None:
    """Put a place for a vertex into `out`: the mean of its neighbors, half the way to it, or steps along the axes."""
    if which < 2:
        part = 1.0 if which == 0 else 0.5
        a, b, c = g.neighbors[i, 0], g.neighbors[i, 1], g.neighbors[i, 2]
        for k in range(3):
            mean = (g.points[a, k] + g.points[b, k] + g.points[c, k]) / 3
            out[k] = start[k] + part * (mean - start[k])
        return
    step = size * (LARGE_STEP if which < 8 else SMALL_STEP)
    out[:] = best
    out[(which - 2) // 2 % 3] += step if which % 2 == 0 else -step


@njit(cache=True, error_model="numpy")
def untangle_vertex(g: Guarded, i: int, before: float, b: Bounds, room: Array) -> float:
    """Put a vertex where least is wrong, of the places to try, and return how much is; `room` is (9, 3)."""
    start, best, there = room[0], room[1], room[2]
    squared = 0.0
    for k in range(3):
        start[k] = best[k] = g.points[i, k]
        for j in range(3):
            squared += (g.points[g.neighbors[i, j], k] - start[k]) ** 2 / 3
    least = before
    for which in range(PLACES):
        place_to_try(g, i, which, start, best, np.sqrt(squared), there)
        put_vertex(g, i, there[0], there[1], there[2])
        total = faults(g, i, b, room[3:], least)
        if total < least - EQUAL:
            total += CROSSING * crossings(g, i, int((least - total) / CROSSING))
        if total < least - EQUAL:
            least = total
            best[:] = there
    put_vertex(g, i, best[0], best[1], best[2])
    return least


@njit(cache=True)
def untangle(g: Guarded, passes: int, b: Bounds) -> int:
    """Put free vertices with faults around them where there are less, pass after pass; return how many have some.

    After the first pass only those are looked at again that were moved, or whose neighbor was.
    """
    room = np.empty((9, 3))
    looked, wrong = g.free.copy(), np.zeros(g.free.size, np.bool_)
    for _ in range(passes):
        better = False
        again = np.zeros(looked.size, np.bool_)
        for i in range(looked.size):
            if not looked[i]:
                continue
            before = faults(g, i, b, room[3:], np.inf)
            if touches_crossed(g, i):
                before += CROSSING * crossings(g, i, MANY)
            wrong[i] = before > 0
            if before > 0:
                after = untangle_vertex(g, i, before, b, room)
                better |= after < before - WORTH
                wrong[i] = after > 0
                if after < before:
                    again[i] = True
                    for j in range(3):
                        again[g.neighbors[i, j]] |= g.free[g.neighbors[i, j]]
        looked = again
        if not better:
            break
    return wrong.sum()


@njit(cache=True)
def overlap(low: Array, high: Array, one: int, other: int) -> bool:
    """Return whether two boxes have a point in common."""
    apart = False
    for k in range(3):
        apart |= low[one, k] > high[other, k] or low[other, k] > high[one, k]
    return not apart


@njit(cache=True, error_model="numpy")
def near_boxes(
    low: Array, high: Array, along: Array, facing: float, origin: Array, cell: float, shape: NDArray[np.int64]
) -> tuple[NDArray[np.int64], Indices]:
    """Return the boxes that overlap each box, itself among them, where vectors `along` have a product up to `facing`.

    Boxes are given by their lowest and highest corners (b, 3); a grid of `shape` cells from `origin` on holds them.
    """
    inside, boxes, span = boxes_by_cell(low, high, origin, cell, shape)
    offsets = np.zeros(low.shape[0] + 1, np.int64)
    near = np.empty(16 * low.shape[0], np.int32)
    seen = np.full(low.shape[0], -1, np.int32)
    found = 0
    for f in range(low.shape[0]):
        for x in range(span[f, 0, 0], span[f, 1, 0] + 1):
            for y in range(span[f, 0, 1], span[f, 1, 1] + 1):
                for z in range(span[f, 0, 2], span[f, 1, 2] + 1):
                    at = (x * shape[1] + y) * shape[2] + z
                    for e in range(inside[at], inside[at + 1]):
                        other = boxes[e]
                        if seen[other] == f:
                            continue
                        seen[other] = f
                        dot = 0.0
                        for k in range(3):
                            dot += along[f, k] * along[other, k]
                        if dot <= facing and overlap(low, high, f, other):
                            if found == near.size:
                                near = np.append(near, np.empty(found, np.int32))
                            near[found] = other
                            found += 1
        offsets[f + 1] = found
    return offsets, near[:found].copy()
