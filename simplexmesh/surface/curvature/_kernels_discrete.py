"""Cotangent Laplacian and angle defect at each vertex."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND, OPEN

MIXED, VORONOI, BARYCENTRIC = range(3)

THIN = 1e-12
"""A triangle whose area is a smaller share of its squared sides has no cotangents."""


@Both
def discrete(centers, offsets, members, closed, points, normals, area, projected, mean, gauss, reasons):
    """Fill H, half the length of the area gradient, and K, the angle defect, both per cell area (Meyer 2003)."""
    for row in prange(centers.shape[0]):
        i, start, stop = centers[row], offsets[row], offsets[row + 1]
        if stop - start < 3 or not closed[row]:
            reasons[row] = FEW if stop - start < 3 else OPEN
            continue
        angles = cell = extent = lx = ly = lz = 0.0
        thin = False
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
                thin = True
                break
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
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        if thin or cell <= THIN * extent or nx * nx + ny * ny + nz * nz < 0.5:
            reasons[row] = DEGENERATE
            continue
        along = lx * nx + ly * ny + lz * nz
        length = along if projected else math.copysign(math.sqrt(lx * lx + ly * ly + lz * lz), along)
        mean[row] = 0.0 if along == 0.0 else length / (4.0 * cell)
        gauss[row] = (2.0 * math.pi - angles) / cell
        reasons[row] = FOUND
