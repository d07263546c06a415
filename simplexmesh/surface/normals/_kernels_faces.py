"""Normals as weighted means of the normals of the faces around a vertex."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import FAST
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

UNIFORM, AREA, ANGLE, MAX = range(4)

SLIVER = 1e-10
"""Two edges the sine of whose angle is smaller span a triangle whose normal is lost to rounding."""


@by_rows(fastmath=FAST)
def face_means(begin, end, centers, rows, wedges, points, weighting, normals, reasons):
    """Fill the normalized sum of the face normals around each center, whose wedges are those of `rows[row]`."""
    offsets, ahead, behind = wedges
    for row in range(begin, end):
        start, stop, i = offsets[rows[row]], offsets[rows[row] + 1], centers[row]
        if start == stop:
            reasons[row] = FEW
            continue
        tx = ty = tz = total = 0.0
        for m in range(start, stop):
            a, b = ahead[m], behind[m]
            ax, ay, az = points[a, 0] - points[i, 0], points[a, 1] - points[i, 1], points[a, 2] - points[i, 2]
            bx, by, bz = points[b, 0] - points[i, 0], points[b, 1] - points[i, 1], points[b, 2] - points[i, 2]
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            double = math.sqrt(x * x + y * y + z * z)
            squares = (ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)
            if double <= SLIVER * math.sqrt(squares):
                continue
            weight = 1.0
            if weighting == UNIFORM:
                weight = 1.0 / double
            elif weighting == ANGLE:
                weight = math.atan2(double, ax * bx + ay * by + az * bz) / double
            elif weighting == MAX:
                weight = 1.0 / squares
            tx += weight * x
            ty += weight * y
            tz += weight * z
            total += weight * double
        length = math.sqrt(tx * tx + ty * ty + tz * tz)
        if length <= SLIVER * total:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = tx / length, ty / length, tz / length
        reasons[row] = FOUND
