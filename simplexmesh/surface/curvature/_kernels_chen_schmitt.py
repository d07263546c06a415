"""Chen and Schmitt: circles through a vertex and two opposite neighbors, fitted by Euler's formula."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface._kernels_opposed import edge_vectors, most_opposite
from simplexmesh.surface.curvature._kernels_solve import FLAT, add_row, principal, solve
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

STRAIGHT = 1e-11
"""A circle whose curvature times the neighbors' distance is less than this is a straight line."""

SINGULAR = 1e-10
"""Scatter determinant of the doubled azimuths, per squared count, below which there are only two directions."""


@njit(cache=True, error_model="numpy")
def _circle(edges, a, b, nx, ny, nz):
    """Return the normal curvature (Meusnier) of the circle through the vertex and two neighbors, and its tangent."""
    ax, ay, az, bx, by, bz = edges[a, 0], edges[a, 1], edges[a, 2], edges[b, 0], edges[b, 1], edges[b, 2]
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    aa, bb, cc = edges[a, 3] * edges[a, 3], edges[b, 3] * edges[b, 3], cx * cx + cy * cy + cz * cz
    # tangent at the vertex: the difference of the edges over their squared lengths
    tx, ty, tz = bx / bb - ax / aa, by / bb - ay / aa, bz / bb - az / aa
    if cc <= STRAIGHT * STRAIGHT * aa * bb:
        return 0.0, tx, ty, tz
    ox = (cy * az - cz * ay) * bb + (by * cz - bz * cy) * aa
    oy = (cz * ax - cx * az) * bb + (bz * cx - bx * cz) * aa
    oz = (cx * ay - cy * ax) * bb + (bx * cy - by * cx) * aa
    # center O = o / 2 cc, |O| = |o| / 2 cc: -(o / |o| . n) / |O|
    return -2.0 * cc * (ox * nx + oy * ny + oz * nz) / (ox * ox + oy * oy + oz * oz), tx, ty, tz


@Both
def chen_schmitt(centers, offsets, members, points, normals, weighted, normalized, k1, k2, d1, reasons):
    """Fit A c^2 + B c s + C s^2 = k to as many circles as neighbors, weighted by 1 / |k| or not (2.33-2.38)."""
    for row in prange(centers.shape[0]):
        start, stop = offsets[row], offsets[row + 1]
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        if stop - start < 3 or nx * nx + ny * ny + nz * nz < 0.5:
            reasons[row] = FEW if stop - start < 3 else DEGENERATE
            continue
        edges, pairs = np.empty((stop - start, 4)), np.empty((stop - start, 2), np.int64)
        count, scale = edge_vectors(points, centers[row], members, start, stop, edges)
        kept = most_opposite(edges, count, normalized, pairs, np.empty(stop - start)) if count >= 3 else 0
        ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
        factor = np.zeros((4, 4))
        sc = ss = scc = sss = scs = 0.0
        used, straight = 0, False
        for t in range(kept):
            k, tx, ty, tz = _circle(edges, pairs[t, 0], pairs[t, 1], nx, ny, nz)
            u, v = ux * tx + uy * ty + uz * tz, vx * tx + vy * ty + vz * tz
            flat = u * u + v * v
            if flat <= FLAT * (tx * tx + ty * ty + tz * tz):
                continue
            used += 1
            straight |= abs(k) < STRAIGHT
            weight = 1.0 / max(abs(k), STRAIGHT) if weighted else 1.0
            uu, uv, vv = u * u / flat, u * v / flat, v * v / flat
            factor[3, 0], factor[3, 1], factor[3, 2], factor[3, 3] = weight * uu, weight * uv, weight * vv, weight * k
            add_row(factor, 3)
            c, s = uu - vv, 2.0 * uv
            sc, ss, scc, sss, scs = sc + c, ss + s, scc + c * c, sss + s * s, scs + c * s
        spread = (scc - sc * sc / used) * (sss - ss * ss / used) - (scs - sc * ss / used) ** 2 if used else 0.0
        if used < 3 or spread <= SINGULAR * used * used:
            reasons[row] = DEGENERATE
            continue
        factor[3] = 0.0
        if not (weighted and straight):  # a straight line has infinite weight, and requires k = 0
            solve(factor, 3, 3)
        mean, amplitude, cosine, sine = principal(
            factor[3, 0] / scale, 0.5 * factor[3, 1] / scale, factor[3, 2] / scale
        )
        k1[row], k2[row] = mean + amplitude, mean - amplitude
        d1[row, 0], d1[row, 1] = cosine * ux + sine * vx, cosine * uy + sine * vy
        d1[row, 2] = cosine * uz + sine * vz
        reasons[row] = FOUND
