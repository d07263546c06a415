"""Regularity of the neighbors around a point: distances, angles, balance."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import FAST
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.surface._kernels_fan import fill_fan
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND


@by_rows(fastmath=FAST)
def spreads(begin, end, centers, rows, points, normals, distances, angles, imbalances, reasons):
    """Fill per row the variances of the neighbors' distances and of the angles between them, and their imbalance."""
    for row in range(begin, end):
        normal = normals[row, 0], normals[row, 1], normals[row, 2]
        count = rows.offsets[row + 1] - rows.offsets[row]
        reasons[row] = FEW if count < 2 else DEGENERATE
        if count < 2 or not normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2] > 0.5:
            continue
        fan, azimuth = np.empty((count, 4)), np.empty(count)
        fill_fan(row, centers[row], rows, points, normal, fan)
        length = flat_length = square = turn = worst = 0.0
        for k in range(count):
            azimuth[k] = math.atan2(fan[k, 1], fan[k, 0])
            length += math.sqrt(fan[k, 3]) / count
            flat_length += math.hypot(fan[k, 0], fan[k, 1]) / count
        if not flat_length > 0.0:
            continue
        azimuth.sort()
        for k in range(count):
            square += (math.sqrt(fan[k, 3]) - length) ** 2 / count
            step = azimuth[k + 1] - azimuth[k] if k + 1 < count else azimuth[0] + 2.0 * math.pi - azimuth[k]
            turn += (step - 2.0 * math.pi / count) ** 2 / count
            least = math.inf
            for other in range(count):
                least = min(least, math.hypot(fan[k, 0] + fan[other, 0], fan[k, 1] + fan[other, 1]))
            worst = max(worst, least)
        distances[row], angles[row], imbalances[row] = square / (length * length), turn, worst / flat_length
        reasons[row] = FOUND
