"""Kernels of voxel solids: Euclidean dilation, and thinning that preserves the topology."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base._kernels_rows import by_rows


@njit(cache=True, error_model="numpy")
def _count_components(inside, wanted, adjacency, mark, stack):
    """Count the components of the `wanted` value, up to two, that are adjacent to the center of a 3x3x3 block."""
    mark[:] = False
    found = 0
    for first in range(26):
        seed = adjacency[13, first]
        if seed < 0:
            break
        if inside[seed] != wanted or mark[seed]:
            continue
        found += 1
        if found > 1:
            return found
        mark[seed] = True
        stack[0] = seed
        top = 1
        while top > 0:
            top -= 1
            here = stack[top]
            for step in range(26):
                there = adjacency[here, step]
                if there < 0:
                    break
                if inside[there] == wanted and not mark[there]:
                    mark[there] = True
                    stack[top] = there
                    top += 1
    return found


@njit(cache=True, error_model="numpy")
def thin(solid, keep, distance_order, adjacency6, adjacency26, rounds):
    """Remove simple cells (m, 3) of `solid`, in `distance_order`, that are not in `keep`, in place; return how many."""
    block = np.zeros(27, np.int8)
    mark = np.zeros(27, np.bool_)
    stack = np.zeros(27, np.int64)
    removed = 0
    for _ in range(rounds):
        before = removed
        for m in range(len(distance_order)):
            i, j, k = distance_order[m]
            if not solid[i, j, k] or keep[i, j, k]:
                continue
            s = 0
            for a in range(i - 1, i + 2):
                for b in range(j - 1, j + 2):
                    for c in range(k - 1, k + 2):
                        block[s] = solid[a, b, c]
                        s += 1
            if block.all():
                continue
            # simple: one 6-connected component inside and one 26-connected outside are adjacent to the cell
            inner = _count_components(block, 1, adjacency6, mark, stack)
            if inner == 1 and _count_components(block, 0, adjacency26, mark, stack) == 1:
                solid[i, j, k] = False
                removed += 1
        if removed == before:
            break
    return removed


@njit(cache=True, error_model="numpy")
def _squares_along(line, most, out):
    """Fill the squared distance of each cell of a line from the nearest true one, if that is at most `most`."""
    last = -1 - most
    for k in range(len(line)):
        if line[k]:
            last = k
        if k - last <= most:
            out[k] = (k - last) ** 2
    last = len(line) + most
    for k in range(len(line) - 1, -1, -1):
        if line[k]:
            last = k
        if last - k <= most:
            out[k] = min(out[k], (last - k) ** 2)


@by_rows(8)
def fill_squares(begin, end, cells, limit, squares, filled):
    """Fill the squared distances from true cells in the same plane, at most `limit` + 1, and the lines below it."""
    _, ny, nz = cells.shape
    most = int(np.sqrt(limit))
    for i in range(begin, end):
        lines = np.full((ny, nz), limit + 1, np.int32)
        known = np.zeros(ny, np.bool_)
        for j in range(ny):
            known[j] = cells[i, j].any()
            if known[j]:
                _squares_along(cells[i, j], most, lines[j])
        for j in range(ny):
            for b in range(max(0, j - most), min(ny, j + most + 1)):
                if known[b]:
                    filled[i, j] = True
                    for k in range(nz):
                        squares[i, j, k] = min(squares[i, j, k], lines[b, k] + (b - j) ** 2)


@by_rows(8)
def fill_within(begin, end, squares, filled, limit, out):
    """Fill whether each cell is within a squared distance `limit` of a true one, given those in the planes."""
    nx, ny, nz = squares.shape
    most = int(np.sqrt(limit))
    for i in range(begin, end):
        for a in range(max(0, i - most), min(nx, i + most + 1)):
            for j in range(ny):
                if filled[a, j]:
                    for k in range(nz):
                        out[i, j, k] |= squares[a, j, k] + (a - i) ** 2 <= limit
