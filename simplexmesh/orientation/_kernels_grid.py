"""Kernels on voxel grids: flood fill and trilinear splatting and interpolation."""

# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit


@njit(cache=True, error_model="numpy")
def mark_near(points, reach, blocked):
    """Set `blocked` (nx, ny, nz) at the samples within distance `reach` of a point."""
    nx, ny, nz = blocked.shape
    limit = reach * reach
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        first, last = max(0, int(np.ceil(z - reach))), min(nz - 1, int(np.floor(z + reach)))
        for i in range(max(0, int(np.ceil(x - reach))), min(nx - 1, int(np.floor(x + reach))) + 1):
            for j in range(max(0, int(np.ceil(y - reach))), min(ny - 1, int(np.floor(y + reach))) + 1):
                plane = (x - i) ** 2 + (y - j) ** 2
                for k in range(first, last + 1):
                    if plane + (z - k) ** 2 <= limit:
                        blocked[i, j, k] = True


@njit(cache=True, error_model="numpy")
def _fill_span(filled, i, j, k, spans, top):
    """Fill the run of free samples along the last axis that contains sample (i, j, k), and push it on the stack."""
    line = filled[i, j]
    low, high = k, k
    while low > 0 and not line[low - 1]:
        low -= 1
    while high < len(line) - 1 and not line[high + 1]:
        high += 1
    line[low : high + 1] = True
    spans[top, 0], spans[top, 1], spans[top, 2], spans[top, 3] = i, j, low, high


@njit(cache=True, error_model="numpy")
def flood(filled):
    """Fill the free samples, those not `filled`, that are 6-connected to sample (0, 0, 0)."""
    nx, ny, nz = filled.shape
    spans = np.empty((nx * ny * (nz // 2 + 1), 4), np.int32)
    top = 0
    if not filled[0, 0, 0]:
        _fill_span(filled, 0, 0, 0, spans, top)
        top += 1
    while top > 0:
        top -= 1
        i, j, low, high = spans[top, 0], spans[top, 1], spans[top, 2], spans[top, 3]
        for side in range(4):
            a, b = i + (side == 0) - (side == 1), j + (side == 2) - (side == 3)
            if a < 0 or b < 0 or a >= nx or b >= ny:
                continue
            line = filled[a, b]
            for c in range(low, high + 1):
                if not line[c]:
                    _fill_span(filled, a, b, c, spans, top)
                    top += 1


@njit(cache=True, error_model="numpy", fastmath=FAST)
def splat(points, values, out):
    """Add `values` (n,) to the eight samples around each point of `out` (nx, ny, nz), with trilinear weights."""
    for p in range(len(points)):
        i, j, k = int(points[p, 0]), int(points[p, 1]), int(points[p, 2])
        x, y, z = points[p, 0] - i, points[p, 1] - j, points[p, 2] - k
        for corner in range(8):
            a, b, c = corner & 1, (corner >> 1) & 1, corner >> 2
            w = (x if a else 1 - x) * (y if b else 1 - y) * (z if c else 1 - z)
            out[i + a, j + b, k + c] += w * values[p]


@njit(cache=True, error_model="numpy", fastmath=FAST)
def interpolate(field, points, values, gradients):
    """Fill `values` (n,) and `gradients` (n, 3) with the trilinear interpolant of `field` and its gradient."""
    for p in range(len(points)):
        i, j, k = int(points[p, 0]), int(points[p, 1]), int(points[p, 2])
        x, y, z = points[p, 0] - i, points[p, 1] - j, points[p, 2] - k
        value = gx = gy = gz = 0.0
        for corner in range(8):
            a, b, c = corner & 1, (corner >> 1) & 1, corner >> 2
            f = field[i + a, j + b, k + c]
            wx, wy, wz = (x if a else 1 - x), (y if b else 1 - y), (z if c else 1 - z)
            value += wx * wy * wz * f
            gx += (f if a else -f) * wy * wz
            gy += (f if b else -f) * wx * wz
            gz += (f if c else -f) * wx * wy
        values[p] = value
        gradients[p, 0], gradients[p, 1], gradients[p, 2] = gx, gy, gz
