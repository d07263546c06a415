"""Cells of a grid within a distance of others: a Euclidean dilation."""

# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._base._kernels_njit import njit


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


@njit(cache=True, error_model="numpy", parallel=True)
def within(cells, limit, out):
    """Fill whether each cell is within a squared distance `limit` of a true one, by windows: radii are small."""
    nx, ny, nz = cells.shape
    most = int(np.sqrt(limit))
    squares = np.full((nx, ny, nz), limit + 1, np.int32)
    filled = np.zeros((nx, ny), np.bool_)
    for i in prange(nx):
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
    for i in prange(nx):
        for a in range(max(0, i - most), min(nx, i + most + 1)):
            for j in range(ny):
                if filled[a, j]:
                    for k in range(nz):
                        out[i, j, k] |= squares[a, j, k] + (a - i) ** 2 <= limit
