"""Taubin's tensor: normal curvatures times the outer products of their directions, weighted by face areas."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface.curvature._kernels_solve import FLAT, principal
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

LINE = 1e-10
"""Scatter determinant of the directions, per squared count, below which they are parallel."""


@Both
def taubin(centers, offsets, members, closed, points, normals, k1, k2, d1, reasons):
    """Fill curvatures from sum w k T T^t per row (Taubin 1995); in rows that are not cycles weights are equal."""
    for row in prange(centers.shape[0]):
        i, start, stop = centers[row], offsets[row], offsets[row + 1]
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        if stop - start < 3 or nx * nx + ny * ny + nz * nz < 0.5:
            reasons[row] = FEW if stop - start < 3 else DEGENERATE
            continue
        ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
        fx = fy = fz = 0.0
        total = suu = suv = svv = tuu = tuv = tvv = 0.0
        count = 0
        for m in range(start, stop):
            j = members[m]
            x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            weight = 1.0
            if closed[row]:
                b, f = members[m + 1 if m + 1 < stop else start], members[m - 1 if m > start else stop - 1]
                fx, fy, fz = points[i, 0] - points[f, 0], points[i, 1] - points[f, 1], points[i, 2] - points[f, 2]
                cx, cy, cz = fy * z - fz * y, fz * x - fx * z, fx * y - fy * x
                weight = math.sqrt(cx * cx + cy * cy + cz * cz)
                fx, fy, fz = points[i, 0] - points[b, 0], points[i, 1] - points[b, 1], points[i, 2] - points[b, 2]
                cx, cy, cz = fy * z - fz * y, fz * x - fx * z, fx * y - fy * x
                weight += math.sqrt(cx * cx + cy * cy + cz * cz)
            square = x * x + y * y + z * z
            u, v = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
            flat = u * u + v * v
            if flat <= FLAT * square:
                continue
            count += 1
            k = 2.0 * (nx * x + ny * y + nz * z) / square
            uu, uv, vv = u * u / flat, u * v / flat, v * v / flat
            suu += uu
            suv += uv
            svv += vv
            total += weight
            tuu += weight * k * uu
            tuv += weight * k * uv
            tvv += weight * k * vv
        if count < 3 or total == 0.0 or suu * svv - suv * suv <= LINE * count * count:
            reasons[row] = DEGENERATE
            continue
        mean, amplitude, cosine, sine = principal(tuu / total, tuv / total, tvv / total)
        k1[row], k2[row] = 2.0 * mean + 4.0 * amplitude, 2.0 * mean - 4.0 * amplitude
        d1[row, 0], d1[row, 1] = cosine * ux + sine * vx, cosine * uy + sine * vy
        d1[row, 2] = cosine * uz + sine * vz
        reasons[row] = FOUND
