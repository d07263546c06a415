"""Quadrics z = a x^2 + b x y + c y^2 (+ d x + e y (+ f)) fitted around each vertex."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface.curvature._kernels_solve import DEPENDENT, add_row, independence, principal, solve
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

SIMPLE, EXTENDED, FULL = 3, 5, 6
"""Terms of the three forms."""

OFFSET = 0.25
"""The offset f is zero where its column is less independent of the others than this."""


@njit(cache=True, error_model="numpy")
def _mean_distance(points, i, members, start, stop):
    """Return the number of neighbors distinct from point i, and their mean distance."""
    count, total = 0, 0.0
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        distance = math.sqrt(x * x + y * y + z * z)
        if distance > 0.0:
            count += 1
            total += distance
    return count, total / max(count, 1)


@njit(cache=True, error_model="numpy")
def _fit(points, i, members, start, stop, frame, scale, terms, factor):
    """Fill the triangular factor, in the frame's coordinates over `scale`; return the unknowns found, or 0."""
    ux, uy, uz, vx, vy, vz, nx, ny, nz = frame
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        x, y, z = x / scale, y / scale, z / scale
        u, v = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
        factor[terms, 0], factor[terms, 1], factor[terms, 2] = u * u, u * v, v * v
        if terms >= EXTENDED:
            factor[terms, 3], factor[terms, 4] = u, v
        if terms == FULL:
            factor[terms, 5] = 1.0
        factor[terms, terms] = nx * x + ny * y + nz * z
        add_row(factor, terms)
    for j in range(min(terms, EXTENDED)):
        if independence(factor, j) < DEPENDENT:
            return 0
    return EXTENDED if terms == FULL and independence(factor, 5) < OFFSET else terms


@Both
def quadric(centers, offsets, members, points, normals, terms, least, k1, k2, d1, corrected, reasons):
    """Fit 3, 5 or 6 terms per row; curvatures are those where the surface meets the center's normal line."""
    for row in prange(centers.shape[0]):
        i, start, stop = centers[row], offsets[row], offsets[row + 1]
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        count, scale = _mean_distance(points, i, members, start, stop)
        if stop - start < least:
            reasons[row] = FEW
            continue
        if count < least or nx * nx + ny * ny + nz * nz < 0.5:
            reasons[row] = DEGENERATE
            continue
        ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
        factor = np.zeros((terms + 1, terms + 1))
        frame = (ux, uy, uz, vx, vy, vz, nx, ny, nz)
        unknowns = _fit(points, i, members, start, stop, frame, scale, terms, factor)
        if unknowns == 0:
            reasons[row] = DEGENERATE
            continue
        solve(factor, terms, unknowns)
        a, b, c = factor[terms, 0] / scale, factor[terms, 1] / scale, factor[terms, 2] / scale
        d, e = (factor[terms, 3], factor[terms, 4]) if terms >= EXTENDED else (0.0, 0.0)
        first, g = 1.0 + d * d, 1.0 + d * d + e * e
        root, cross = math.sqrt(g), d * e
        # minus the second fundamental form on the tangents (1, 0, d) and (-d e, 1 + d^2, e), normalized
        p = -2.0 * a / (root * first)
        q = (2.0 * cross * a - first * b) / (g * first)
        r = -2.0 * (cross * cross * a - cross * first * b + first * first * c) / (g * root * first)
        mean, amplitude, cosine, sine = principal(p, q, r)
        k1[row], k2[row] = mean + amplitude, mean - amplitude
        cosine, sine = cosine / math.sqrt(first), sine / math.sqrt(first * g)
        tu, tv, tn = cosine - sine * cross, sine * first, cosine * d + sine * e
        d1[row, 0], d1[row, 1] = tu * ux + tv * vx + tn * nx, tu * uy + tv * vy + tn * ny
        d1[row, 2] = tu * uz + tv * vz + tn * nz
        corrected[row, 0], corrected[row, 1] = (nx - d * ux - e * vx) / root, (ny - d * uy - e * vy) / root
        corrected[row, 2] = (nz - d * uz - e * vz) / root
        reasons[row] = FOUND
