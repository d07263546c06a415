"""Kernels that untangle a mesh: search for vertex positions with fewer folds and crossings; overlapping boxes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._kernels_njit import njit
from simplexmesh.mesh._kernels_crossing import boxes_by_cell
from simplexmesh.mesh._kernels_fans import MovingMesh, crossings, touches_crossed
from simplexmesh.mesh._kernels_guard import NO_LIMIT, TOLERANCE, Bounds, local_penalty, move_vertex

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

CROSSING_PENALTY = 0.5
"""Penalty of a pair of crossing triangles."""

N_CANDIDATES = 14
LARGE_STEP, SMALL_STEP = 0.3, 0.1

MIN_GAIN = 0.02
"""Another pass is made if the penalty of some vertex decreased by more than this."""


@njit(cache=True, error_model="numpy")
def candidate(g: MovingMesh, i: int, which: int, start: Array, best: Array, size: float, out: Array) -> None:
    """Write a candidate position to `out`: the neighbors' mean, halfway to it, or a step along an axis from `best`."""
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
def untangle_vertex(g: MovingMesh, i: int, before: float, b: Bounds, workspace: Array) -> float:
    """Move a vertex to the candidate of least penalty and return that; `workspace` is (9, 3)."""
    start, best, there = workspace[0], workspace[1], workspace[2]
    squared = 0.0
    for k in range(3):
        start[k] = best[k] = g.points[i, k]
        for j in range(3):
            squared += (g.points[g.neighbors[i, j], k] - start[k]) ** 2 / 3
    least = before
    for which in range(N_CANDIDATES):
        candidate(g, i, which, start, best, np.sqrt(squared), there)
        move_vertex(g, i, there[0], there[1], there[2])
        total = local_penalty(g, i, b, workspace[3:], least)
        if total < least - TOLERANCE:
            total += CROSSING_PENALTY * crossings(g, i, int((least - total) / CROSSING_PENALTY))
        if total < least - TOLERANCE:
            least = total
            best[:] = there
    move_vertex(g, i, best[0], best[1], best[2])
    return least


@njit(cache=True)
def untangle(g: MovingMesh, passes: int, b: Bounds) -> int:
    """Move free vertices with a penalty to where it is smaller, in passes; return how many still have one.

    After the first pass only vertices that were moved and their neighbors are visited.
    """
    workspace = np.empty((9, 3))
    active, invalid = g.free.copy(), np.zeros(g.free.size, np.bool_)
    for _ in range(passes):
        better = False
        following = np.zeros(active.size, np.bool_)
        for i in range(active.size):
            if not active[i]:
                continue
            before = local_penalty(g, i, b, workspace[3:], np.inf)
            if touches_crossed(g, i):
                before += CROSSING_PENALTY * crossings(g, i, NO_LIMIT)
            invalid[i] = before > 0
            if before > 0:
                after = untangle_vertex(g, i, before, b, workspace)
                better |= after < before - MIN_GAIN
                invalid[i] = after > 0
                if after < before:
                    following[i] = True
                    for j in range(3):
                        following[g.neighbors[i, j]] |= g.free[g.neighbors[i, j]]
        active = following
        if not better:
            break
    return invalid.sum()


@njit(cache=True)
def overlap(low: Array, high: Array, one: int, other: int) -> bool:
    """Return whether two boxes intersect."""
    apart = False
    for k in range(3):
        apart |= low[one, k] > high[other, k] or low[other, k] > high[one, k]
    return not apart


@njit(cache=True, error_model="numpy")
def overlapping_boxes(
    low: Array, high: Array, normals: Array, max_dot: float, origin: Array, cell: float, shape: NDArray[np.int64]
) -> tuple[NDArray[np.int64], Indices]:
    """Return the boxes that overlap each box, as CSR, if the dot product of their normals is at most `max_dot`.

    With `max_dot` above 1 each box is among its own. Boxes are given by their lower and upper corners (b, 3), inside a
    grid of `shape` cells from `origin`.
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
                            dot += normals[f, k] * normals[other, k]
                        if dot <= max_dot and overlap(low, high, f, other):
                            if found == near.size:
                                near = np.append(near, np.empty(found, np.int32))
                            near[found] = other
                            found += 1
        offsets[f + 1] = found
    return offsets, near[:found].copy()
