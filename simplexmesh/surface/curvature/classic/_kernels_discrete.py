"""Cotangent Laplacian and angle defect at each vertex."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND, OPEN

MIXED, VORONOI, BARYCENTRIC = range(3)

THIN = 1e-12
"""A triangle whose area is a smaller share of its squared sides has no cotangents."""


class MeanAndGauss(NamedTuple):
    """H and K of each row."""

    mean: Array
    gauss: Array


@by_rows(fastmath=FAST)
def discrete(begin, end, centers, rows, points, normals, area, projected, out, reasons):
    """Fill H, half the length of the area gradient, and K, the angle defect, both per cell area (Meyer 2003)."""
    for row in range(begin, end):
        reasons[row] = _measured(row, centers[row], rows, points, normals, area, projected, out)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _measured(row, i, rows, points, normals, area, projected, out):
    """Measure one row and return its reason."""
    members, start, stop = rows.members, rows.offsets[row], rows.offsets[row + 1]
    if stop - start < 3 or not rows.closed[row]:
        return FEW if stop - start < 3 else OPEN
    nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
    angles = cell = extent = lx = ly = lz = 0.0
    b = members[stop - 1]
    vx, vy, vz = points[b, 0] - points[i, 0], points[b, 1] - points[i, 1], points[b, 2] - points[i, 2]
    vv = vx * vx + vy * vy + vz * vz
    for m in range(start, stop):
        ux, uy, uz, uu, b = vx, vy, vz, vv, members[m]
        vx, vy, vz = points[b, 0] - points[i, 0], points[b, 1] - points[i, 1], points[b, 2] - points[i, 2]
        vv, uv = vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
        cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        double = math.sqrt(cx * cx + cy * cy + cz * cz)
        if double <= THIN * (uu + vv):
            return DEGENERATE
        angles += math.atan2(double, uv)
        cot_u, cot_v = (uu - uv) / double, (vv - uv) / double
        lx -= cot_u * vx + cot_v * ux
        ly -= cot_u * vy + cot_v * uy
        lz -= cot_u * vz + cot_v * uz
        extent += uu
        if area == BARYCENTRIC:
            cell += double / 6.0
        elif area == MIXED and uv < 0.0:
            cell += double / 4.0
        elif area == MIXED and (cot_u < 0.0 or cot_v < 0.0):
            cell += double / 8.0
        else:
            cell += (cot_u * vv + cot_v * uu) / 8.0
    if cell <= THIN * extent or nx * nx + ny * ny + nz * nz < 0.5:
        return DEGENERATE
    along = lx * nx + ly * ny + lz * nz
    length = along if projected else math.copysign(math.sqrt(lx * lx + ly * ly + lz * lz), along)
    out.mean[row] = 0.0 if along == 0.0 else length / (4.0 * cell)
    out.gauss[row] = (2.0 * math.pi - angles) / cell
    return FOUND
