"""SineFitting: least-squares fit of Euler's formula to the normal curvatures around a vertex."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface.curvature._kernels_solve import FLAT
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

SINGULAR = 1e-10
"""Scatter determinant of the doubled azimuths, per squared count, below which there are only two directions."""

SPREAD = 1e-5
"""Scatter trace of the doubled azimuths, per count, below which there is only one."""


@njit(cache=True, error_model="numpy")
def _solved(scc, sss, scs, skc, sks, count, least_swing):
    """Solve the 2 x 2 normal equations; where they are singular return the minimum-norm solution, or NaN."""
    det = scc * sss - scs * scs
    if det > SINGULAR * count * count:
        return (skc * sss - sks * scs) / det, (sks * scc - skc * scs) / det
    trace = scc + sss
    if not least_swing or trace <= SPREAD * count:
        return math.nan, math.nan
    turn = 0.5 * math.atan2(2.0 * scs, scc - sss)
    c, s = math.cos(turn), math.sin(turn)
    along = (skc * c + sks * s) / (scc * c * c + 2.0 * scs * c * s + sss * s * s)
    return along * c, along * s


@Both
def sine(centers, offsets, members, points, normals, least_swing, k1, k2, d1, reasons):
    """Fit k_i = a cos 2 alpha_i + b sin 2 alpha_i + c per row by least squares (Charton 2014, 2.44)."""
    for row in prange(centers.shape[0]):
        i = centers[row]
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        nx, ny, nz = normals[row, 0], normals[row, 1], normals[row, 2]
        ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
        sc = ss = scc = sss = scs = sk = skc = sks = 0.0
        count = 0
        for m in range(offsets[row], offsets[row + 1]):
            j = members[m]
            x, y, z = px - points[j, 0], py - points[j, 1], pz - points[j, 2]
            square = x * x + y * y + z * z
            u, v = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
            flat = u * u + v * v
            if flat <= FLAT * square or square == 0.0:
                continue
            k = 2.0 * (nx * x + ny * y + nz * z) / square
            c, s = (u * u - v * v) / flat, 2.0 * u * v / flat
            count += 1
            sc += c
            ss += s
            scc += c * c
            sss += s * s
            scs += c * s
            sk += k
            skc += k * c
            sks += k * s
        if offsets[row + 1] - offsets[row] < 3 or nx * nx + ny * ny + nz * nz < 0.5:
            reasons[row] = FEW if offsets[row + 1] - offsets[row] < 3 else DEGENERATE
            continue
        if count < 3:
            reasons[row] = DEGENERATE
            continue
        w = 1.0 / count
        scc, sss, scs = scc - w * sc * sc, sss - w * ss * ss, scs - w * sc * ss
        skc, sks = skc - w * sk * sc, sks - w * sk * ss
        a, b = _solved(scc, sss, scs, skc, sks, count, least_swing)
        if math.isnan(a):
            reasons[row] = DEGENERATE
            continue
        mean = w * (sk - a * sc - b * ss)
        amplitude = math.sqrt(a * a + b * b)
        half = 0.5 * math.atan2(b, a)
        cosine, sine_half = math.cos(half), math.sin(half)
        k1[row], k2[row] = mean + amplitude, mean - amplitude
        d1[row, 0], d1[row, 1] = cosine * ux + sine_half * vx, cosine * uy + sine_half * vy
        d1[row, 2] = cosine * uz + sine_half * vz
        reasons[row] = FOUND
