"""Regularity of the neighbors around a point: distances, angles, balance."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND


@Both
def spreads(centers, offsets, members, points, normals, distances, angles, imbalances, reasons):
    """Fill per row the variances of the neighbors' distances and of the angles between them, and their imbalance."""
    for row in prange(centers.shape[0]):
        start, stop, i = offsets[row], offsets[row + 1], centers[row]
        m = stop - start
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        if m < 2 or not nx * nx + ny * ny + nz * nz > 0.5:
            reasons[row] = FEW if m < 2 else DEGENERATE
            continue
        ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
        flat, azimuth = np.zeros((m, 2)), np.zeros(m)
        length = square = flat_length = 0.0
        for k in range(m):
            j = members[start + k]
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            flat[k, 0], flat[k, 1] = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
            azimuth[k] = math.atan2(flat[k, 1], flat[k, 0])
            length += math.sqrt(x * x + y * y + z * z) / m
            flat_length += math.sqrt(flat[k, 0] ** 2 + flat[k, 1] ** 2) / m
        if not flat_length > 0.0:
            reasons[row] = DEGENERATE
            continue
        for k in range(m):
            j = members[start + k]
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            square += (math.sqrt(x * x + y * y + z * z) - length) ** 2 / m
        azimuth.sort()
        turn, worst = 0.0, 0.0
        for k in range(m):
            step = azimuth[k + 1] - azimuth[k] if k + 1 < m else azimuth[0] + 2.0 * math.pi - azimuth[k]
            turn += (step - 2.0 * math.pi / m) ** 2 / m
            least = math.inf
            for other in range(m):
                least = min(least, math.hypot(flat[k, 0] + flat[other, 0], flat[k, 1] + flat[other, 1]))
            worst = max(worst, least)
        distances[row], angles[row], imbalances[row] = square / (length * length), turn, worst / flat_length
        reasons[row] = FOUND
