"""Normals as means of the faces around a vertex."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

UNIFORM, AREA, ANGLE = range(3)


@Both
def face_means(centers, offsets, members, closed, points, weighting, normals, reasons):
    """Fill the normalized mean of the face normals around each center, weighted as asked; the ring is in order."""
    for row in prange(centers.shape[0]):
        start, stop, i = offsets[row], offsets[row + 1], centers[row]
        if stop - start < 2:
            reasons[row] = FEW
            continue
        tx = ty = tz = 0.0
        for m in range(start, stop):
            if m + 1 == stop and not closed[row]:
                break
            a, b = members[m], members[m + 1 if m + 1 < stop else start]
            ax, ay, az = points[a, 0] - points[i, 0], points[a, 1] - points[i, 1], points[a, 2] - points[i, 2]
            bx, by, bz = points[b, 0] - points[i, 0], points[b, 1] - points[i, 1], points[b, 2] - points[i, 2]
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            double = math.sqrt(x * x + y * y + z * z)
            if double == 0.0:
                continue
            weight = 1.0
            if weighting == UNIFORM:
                weight = 1.0 / double
            elif weighting == ANGLE:
                weight = math.atan2(double, ax * bx + ay * by + az * bz) / double
            tx += weight * x
            ty += weight * y
            tz += weight * z
        length = math.sqrt(tx * tx + ty * ty + tz * tz)
        if length == 0.0:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = tx / length, ty / length, tz / length
        reasons[row] = FOUND
