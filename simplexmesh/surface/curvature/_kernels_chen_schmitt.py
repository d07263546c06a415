"""Chen and Schmitt: circles through a vertex and two neighbors across from each other, fitted by Euler's formula."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface._kernels_opposed import arms_of, most_opposed
from simplexmesh.surface.curvature._kernels_solve import FLAT, absorb, principal, solve
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

STRAIGHT = 1e-11
"""A circle that bends less than this over the neighbors' distance is a straight line."""

SINGULAR = 1e-10
"""Directions whose spread on the double angle is a smaller share of the largest possible are taken for two."""


@njit(cache=True, error_model="numpy")
def _circle(arms, a, b, nx, ny, nz):
    """Return the normal curvature by Meusnier of the circle through the vertex and two arms, and its tangent there."""
    ax, ay, az, bx, by, bz = arms[a, 0], arms[a, 1], arms[a, 2], arms[b, 0], arms[b, 1], arms[b, 2]
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    aa, bb, cc = arms[a, 3] * arms[a, 3], arms[b, 3] * arms[b, 3], cx * cx + cy * cy + cz * cz
    # the tangent of a circle at a point between two others: the arms over their lengths squared, one from the other
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
    """Fit A c^2 + B c s + C s^2 = k to as many circles as there are neighbors, weighted 1 / |k| or not (2.33-2.38)."""
    for row in prange(centers.shape[0]):
        start, stop = offsets[row], offsets[row + 1]
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        if stop - start < 3 or nx * nx + ny * ny + nz * nz < 0.5:
            reasons[row] = FEW if stop - start < 3 else DEGENERATE
            continue
        arms, triples = np.empty((stop - start, 4)), np.empty((stop - start, 2), np.int64)
        count, scale = arms_of(points, centers[row], members, start, stop, arms)
        kept = most_opposed(arms, count, normalized, triples, np.empty(stop - start)) if count >= 3 else 0
        ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
        table = np.zeros((4, 4))
        sc = ss = scc = sss = scs = 0.0
        used, straight = 0, False
        for t in range(kept):
            k, tx, ty, tz = _circle(arms, triples[t, 0], triples[t, 1], nx, ny, nz)
            u, v = ux * tx + uy * ty + uz * tz, vx * tx + vy * ty + vz * tz
            flat = u * u + v * v
            if flat <= FLAT * (tx * tx + ty * ty + tz * tz):
                continue
            used += 1
            straight |= abs(k) < STRAIGHT
            weight = 1.0 / max(abs(k), STRAIGHT) if weighted else 1.0
            uu, uv, vv = u * u / flat, u * v / flat, v * v / flat
            table[3, 0], table[3, 1], table[3, 2], table[3, 3] = weight * uu, weight * uv, weight * vv, weight * k
            absorb(table, 3)
            c, s = uu - vv, 2.0 * uv
            sc, ss, scc, sss, scs = sc + c, ss + s, scc + c * c, sss + s * s, scs + c * s
        spread = (scc - sc * sc / used) * (sss - ss * ss / used) - (scs - sc * ss / used) ** 2 if used else 0.0
        if used < 3 or spread <= SINGULAR * used * used:
            reasons[row] = DEGENERATE
            continue
        table[3] = 0.0
        if not (weighted and straight):  # a straight line has all the weight there is, and k = 0 is its least fit
            solve(table, 3, 3)
        mean, swing, cosine, sine = principal(table[3, 0] / scale, 0.5 * table[3, 1] / scale, table[3, 2] / scale)
        k1[row], k2[row] = mean + swing, mean - swing
        d1[row, 0], d1[row, 1] = cosine * ux + sine * vx, cosine * uy + sine * vy
        d1[row, 2] = cosine * uz + sine * vz
        reasons[row] = FOUND
