"""Normals as cross products of the tangents of circles through a vertex and pairs of its neighbors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.surface._kernels_circles import circle, opposite_pairs
from simplexmesh.surface._kernels_fan import fill_fan
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

SIDELESS = 1e-9
"""A cross product with a smaller share of its length along the reference has no reliable sign."""


@njit(cache=True, error_model="numpy")
def _sum_of_products(fan, pairs, kept, directions):
    """Return the sum of the cross products of all pairs of tangents, each on the side of the frame's normal."""
    for pair in range(kept):
        _, x, y, z = circle(fan, pairs[pair, 0], pairs[pair, 1])
        length = math.sqrt(x * x + y * y + z * z)
        scale = 1.0 / length if length > 0.0 else 0.0
        directions[pair, 0], directions[pair, 1], directions[pair, 2] = scale * x, scale * y, scale * z
    tx = ty = tz = 0.0
    for a in range(kept):
        for b in range(a + 1, kept):
            x = directions[a, 1] * directions[b, 2] - directions[a, 2] * directions[b, 1]
            y = directions[a, 2] * directions[b, 0] - directions[a, 0] * directions[b, 2]
            z = directions[a, 0] * directions[b, 1] - directions[a, 1] * directions[b, 0]
            if abs(z) > SIDELESS * math.sqrt(x * x + y * y + z * z):
                side = math.copysign(1.0, z)
                tx += side * x
                ty += side * y
                tz += side * z
    return tx, ty, tz


@by_rows(fastmath=FAST)
def chen_schmitt(begin, end, centers, rows, points, reference, normalized, normals, reasons):
    """Fill the normal of each row from its most opposite pairs, as many as neighbors."""
    for row in range(begin, end):
        nx, ny, nz = reference[row, 0], reference[row, 1], reference[row, 2]
        reasons[row] = DEGENERATE
        if rows.offsets[row + 1] - rows.offsets[row] < 3:
            reasons[row] = FEW
        elif nx * nx + ny * ny + nz * nz > 0.5:
            count = rows.offsets[row + 1] - rows.offsets[row]
            fan, pairs = np.empty((count, 4)), np.empty((count, 2), np.int64)
            fill_fan(row, centers[row], rows, points, (nx, ny, nz), fan)
            kept, _ = opposite_pairs(fan, count, normalized, pairs, np.empty(count))
            u, v, w = _sum_of_products(fan, pairs, kept, np.empty((count, 3)))
            length = math.sqrt(u * u + v * v + w * w)
            if length > 1e-10 * count:
                u, v, w = u / length, v / length, w / length
                ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
                normals[row, 0], normals[row, 1] = u * ux + v * vx + w * nx, u * uy + v * vy + w * ny
                normals[row, 2] = u * uz + v * vz + w * nz
                reasons[row] = FOUND
