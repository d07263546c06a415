"""Score motions, and refine them by point-to-plane steps, with nearest points from a grid.

Arrays in, arrays out; no checks. A motion is a row of 12 numbers: the rows of the matrix (3, 4). All sources share one
call, which threads share.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array, Indices, Indices32
from simplexmesh.numerics._kernels_matrices import solve
from simplexmesh.recognition.sai._kernels_rotations import rotate


class TargetGrid(NamedTuple):
    """A target (n, 6), points and normals, and the row of the point nearest to each cell of a grid (i, j, k)."""

    planes: Array
    nearest: Indices32
    low: Array
    cell: float


class SourceColumns(NamedTuple):
    """Points and normals of several sources as columns (6, k); source i has those in ``starts[i] : starts[i + 1]``."""

    columns: Array
    starts: Indices


@njit(cache=True, error_model="numpy")
def _nearest_row(grid, scale, x, y, z):
    """Return the row of the target point nearest to the cell of a point, or -1 outside; `scale` is 1 / cell size."""
    nearest, low = grid.nearest, grid.low
    # unsigned indices need one comparison each, and no wraparound of negative ones
    i = np.uint64(np.int64(math.floor((x - low[0]) * scale)))
    j = np.uint64(np.int64(math.floor((y - low[1]) * scale)))
    k = np.uint64(np.int64(math.floor((z - low[2]) * scale)))
    if i >= np.uint64(nearest.shape[0]) or j >= np.uint64(nearest.shape[1]) or k >= np.uint64(nearest.shape[2]):
        return np.int64(-1)
    return np.int64(nearest[i, j, k])


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _score(m, sources, owner, grid, width):
    """Return the score of one motion; without branches, so that the loop is vectorized."""
    a, b, c, d, e, f = m[0], m[1], m[2], m[3], m[4], m[5]
    g, h, i, j, k, n = m[6], m[7], m[8], m[9], m[10], m[11]
    columns, first, last = sources.columns, sources.starts[owner], sources.starts[owner + 1]
    px, py, pz = columns[0, first:last], columns[1, first:last], columns[2, first:last]
    nx, ny, nz = columns[3, first:last], columns[4, first:last], columns[5, first:last]
    cells, (sx, sy, sz), planes = grid.nearest.ravel(), grid.nearest.shape, grid.planes.ravel()
    lx, ly, lz, scale = grid.low[0], grid.low[1], grid.low[2], 1.0 / grid.cell
    squared_reach = 4.0 * max(grid.cell, width) ** 2
    inverse_square, total = 1.0 / (width * width), 0.0
    for s in range(len(px)):
        x, y = a * px[s] + b * py[s] + c * pz[s] + d, e * px[s] + f * py[s] + g * pz[s] + h
        z = i * px[s] + j * py[s] + k * pz[s] + n
        u, v, w = (x - lx) * scale, (y - ly) * scale, (z - lz) * scale
        inside = (u >= 0) & (v >= 0) & (w >= 0) & (u < sx) & (v < sy) & (w < sz)
        u, v, w = min(max(u, 0.0), sx - 1.0), min(max(v, 0.0), sy - 1.0), min(max(w, 0.0), sz - 1.0)
        t = 6 * np.int64(cells[(np.int64(u) * sy + np.int64(v)) * sz + np.int64(w)])
        x, y, z = x - planes[t], y - planes[t + 1], z - planes[t + 2]
        p, q, r = planes[t + 3], planes[t + 4], planes[t + 5]
        residual = x * p + y * q + z * r
        cosine = (
            (a * nx[s] + b * ny[s] + c * nz[s]) * p
            + (e * nx[s] + f * ny[s] + g * nz[s]) * q
            + (i * nx[s] + j * ny[s] + k * nz[s]) * r
        )
        score = max(-1.0, 1 - residual * residual * inverse_square) * max(cosine, 0.0)
        total += score if inside & (x * x + y * y + z * z <= squared_reach) else 0.0
    return total / len(px)


@by_rows(20)
def score_motions(begin, end, motions, owners, sources, grid, widths, scores):
    """Fill the score of motion h of source ``owners[h]``: the mean of a distance score times the cosine of normals."""
    for h in range(begin, end):
        scores[h] = _score(motions[h], sources, owners[h], grid, widths[owners[h]])


@njit(cache=True, error_model="numpy")
def _apply_small_motion(m, x):
    """Apply to a motion, in place, the small motion x: a rotation vector, then a shift."""
    rows = m.reshape(3, 4)
    rotate(x[0], x[1], x[2], rows.copy(), rows)
    rows[:, 3] += x[3:]


@njit(cache=True, error_model="numpy")
def _normal_equations(m, sources, owner, grid, width, A, b):
    """Fill the lower triangle of A (6, 6), and b (6,), of a weighted point-to-plane step; return the sum of weights."""
    A[:] = 0.0
    b[:] = 0.0
    columns, target, scale = sources.columns, grid.planes, 1.0 / grid.cell
    weights, inverse_square = 0.0, 1.0 / (width * width)
    for s in range(sources.starts[owner], sources.starts[owner + 1]):
        px, py, pz = columns[0, s], columns[1, s], columns[2, s]
        x = m[0] * px + m[1] * py + m[2] * pz + m[3]
        y = m[4] * px + m[5] * py + m[6] * pz + m[7]
        z = m[8] * px + m[9] * py + m[10] * pz + m[11]
        near = _nearest_row(grid, scale, x, y, z)
        if near < 0:
            continue
        t = np.uint64(near)
        nx, ny, nz = target[t, 3], target[t, 4], target[t, 5]
        dx, dy, dz = x - target[t, 0], y - target[t, 1], z - target[t, 2]
        far = (dx * dx + dy * dy + dz * dz) * inverse_square
        px, py, pz = columns[3, s], columns[4, s], columns[5, s]
        cosine = (
            (m[0] * px + m[1] * py + m[2] * pz) * nx
            + (m[4] * px + m[5] * py + m[6] * pz) * ny
            + (m[8] * px + m[9] * py + m[10] * pz) * nz
        )
        if far > 4.0 or cosine < 0.2:
            continue
        weight = cosine / (1 + far) ** 2
        row = (y * nz - z * ny, z * nx - x * nz, x * ny - y * nx, nx, ny, nz)
        residual = weight * (dx * nx + dy * ny + dz * nz)
        weights += weight
        for i in range(6):
            b[i] -= residual * row[i]
            for j in range(i + 1):
                A[i, j] += weight * row[i] * row[j]
    return weights


@by_rows(4)
def refine_motions(begin, end, motions, owners, sources, grid, widths):
    """Refine motions, in place: one weighted point-to-plane step for each of the source's widths (m, steps)."""
    for h in range(begin, end):
        A, b = np.zeros((6, 6)), np.zeros(6)
        for width in widths[owners[h]]:
            weights = _normal_equations(motions[h], sources, owners[h], grid, width, A, b)
            for i in range(6):
                A[i, i] += 1e-3 * weights * (0.05 if i < 3 else 1.0) + 1e-9
            if solve(A, b, 6):
                _apply_small_motion(motions[h], b)
