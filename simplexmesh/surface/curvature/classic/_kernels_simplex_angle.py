"""Curvatures of a simplex mesh: the sphere through a vertex and its three neighbors, and its Gauss map."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import FAST
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.surface.reasons import DEGENERATE, FOUND, OPEN

THIN = 1e-12
"""Three neighbors whose triangle is a smaller share of its squared sides have no plane."""


@by_rows(fastmath=FAST)
def mean_curvatures(begin, end, neighbors, points, mean, normals, areas, reasons):
    """Fill H, the normal of the three neighbors' plane and the area of their triangle per row (Delingette 1994)."""
    for i in range(begin, end):
        a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
        if a < 0 or b < 0 or c < 0:
            reasons[i] = OPEN
            continue
        px, py, pz = points[i, 0] - points[a, 0], points[i, 1] - points[a, 1], points[i, 2] - points[a, 2]
        bx, by, bz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        cx, cy, cz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        wx, wy, wz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        pp, bb, cc = px * px + py * py + pz * pz, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
        double = math.sqrt(wx * wx + wy * wy + wz * wz)
        if double <= THIN * (bb + cc):
            reasons[i] = DEGENERATE
            continue
        sx = pp * wx + bb * (cy * pz - cz * py) + cc * (py * bz - pz * by)
        sy = pp * wy + bb * (cz * px - cx * pz) + cc * (pz * bx - px * bz)
        sz = pp * wz + bb * (cx * py - cy * px) + cc * (px * by - py * bx)
        bottom = math.sqrt(sx * sx + sy * sy + sz * sz)
        if bottom <= THIN * double * (pp + bb + cc):
            reasons[i] = DEGENERATE
            continue
        mean[i] = 2.0 * (px * wx + py * wy + pz * wz) / bottom
        normals[i, 0], normals[i, 1], normals[i, 2] = wx / double, wy / double, wz / double
        areas[i] = 0.5 * double
        reasons[i] = FOUND


@by_rows(fastmath=FAST)
def gauss_curvatures(begin, end, neighbors, normals, areas, found, gauss, reasons):
    """Fill K, the solid angle of the three neighbors' normals over the area of their triangle, per row."""
    for i in range(begin, end):
        reasons[i] = found[i]
        if found[i] != FOUND:
            continue
        a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
        if found[a] != FOUND or found[b] != FOUND or found[c] != FOUND:
            reasons[i] = max(found[a], found[b], found[c])
            continue
        ax, ay, az = normals[a, 0], normals[a, 1], normals[a, 2]
        bx, by, bz = normals[b, 0], normals[b, 1], normals[b, 2]
        cx, cy, cz = normals[c, 0], normals[c, 1], normals[c, 2]
        volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        sides = ax * bx + ay * by + az * bz + bx * cx + by * cy + bz * cz + cx * ax + cy * ay + cz * az
        gauss[i] = 2.0 * math.atan2(volume, 1.0 + sides) / areas[i]
