"""One robust quadratic fit to the points around a place.

A surfel is a row of numbers: 0-2 a point on the fit, 3-5 its unit normal, 6-11 the second-order form Q as
(xx, yy, zz, xy, xz, yz), so that ``normal . d - d' Q d / 2`` is the height of ``point + d`` above the fit. A report is
a row of: OFFSET of the fit from the place along its normal, its VARIANCE, the NOISE of the points along the normal,
their COUNT, ECCENTRICITY, the tangential distance of their weighted center over the radius (large at a border), and
CURVATURE, the root of the sum of the squared principal curvatures.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._kernels_both import FAST
from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_algebra import align_tangents, bilinear_form, median, set_form, solve, tangents

OFFSET, VARIANCE, NOISE, COUNT, ECCENTRICITY, CURVATURE = range(6)
VARIANCE_FLOOR = 0.04  # isotropic part of the variance of known errors
TUKEY = 4.685  # cutoff of Tukey's weights, in standard deviations


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _local_coordinates(points, spread, members, count, surfel, u, v, inverse, s, t, h, w, e):
    """Fill, per member within the radius, its coordinates in the surfel's frame in radii, weight and known variance."""
    cx, cy, cz, nx, ny, nz = surfel[0], surfel[1], surfel[2], surfel[3], surfel[4], surfel[5]
    u0, u1, u2, v0, v1, v2 = u[0], u[1], u[2], v[0], v[1], v[2]
    known = len(spread) > 0
    n = 0
    for i in range(count):
        p = members[i]
        dx, dy, dz = points[p, 0] - cx, points[p, 1] - cy, points[p, 2] - cz
        a = (dx * u0 + dy * u1 + dz * u2) * inverse
        b = (dx * v0 + dy * v1 + dz * v2) * inverse
        c = (dx * nx + dy * ny + dz * nz) * inverse
        weight = 1.0 - a * a - b * b
        if weight <= 0.0 or abs(c) > 1.0:
            continue
        s[n], t[n], h[n], w[n] = a, b, c, weight
        if known:
            error = (spread[p, 0] * nx + spread[p, 1] * ny + spread[p, 2] * nz) * inverse
            whole = (spread[p, 0] ** 2 + spread[p, 1] ** 2 + spread[p, 2] ** 2) * inverse * inverse
            e[n] = error * error + VARIANCE_FLOOR * whole
            w[n] *= whole / e[n]
        n += 1
    return n


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _normal_equations(s, t, h, w, n, quadratic, scale, m, rhs):
    """Fill the normal equations of a quadratic fit, (6, 6) and (6,), with Tukey weights about the form `quadratic`.

    Basis 1, s, t, s^2/2, s t, t^2/2. Returns the weighted center.
    """
    m0 = m1 = m2 = m3 = m4 = m5 = m6 = m7 = m8 = m9 = m10 = m11 = m12 = m13 = m14 = 0.0
    r0 = r1 = r2 = r3 = r4 = r5 = 0.0
    b3, b4, b5 = 0.5 * quadratic[0], quadratic[1], 0.5 * quadratic[2]
    inverse = 1.0 / scale
    for i in range(n):
        a, b, c = s[i], t[i], h[i]
        aa, ab, bb = a * a, a * b, b * b
        q = (c - b3 * aa - b4 * ab - b5 * bb) * inverse
        q = max(1.0 - q * q, 0.0)
        x = w[i] * q * q
        m0 += x
        m1 += x * a
        m2 += x * b
        xaa, xab, xbb = x * aa, x * ab, x * bb
        m3 += xaa
        m4 += xab
        m5 += xbb
        m6 += xaa * a
        m7 += xaa * b
        m8 += xab * b
        m9 += xbb * b
        m10 += xaa * aa
        m11 += xaa * ab
        m12 += xaa * bb
        m13 += xab * bb
        m14 += xbb * bb
        xc = x * c
        r0 += xc
        r1 += xc * a
        r2 += xc * b
        r3 += xc * aa
        r4 += xc * ab
        r5 += xc * bb
    m[0, 0], m[1, 0], m[2, 0], m[1, 1], m[2, 1], m[2, 2] = m0, m1, m2, m3, m4, m5
    m[3, 0], m[3, 1], m[3, 2], m[3, 3] = 0.5 * m3, 0.5 * m6, 0.5 * m7, 0.25 * m10
    m[4, 0], m[4, 1], m[4, 2], m[4, 3], m[4, 4] = m4, m7, m8, 0.5 * m11, m12
    m[5, 0], m[5, 1], m[5, 2], m[5, 3], m[5, 4], m[5, 5] = (
        0.5 * m5,
        0.5 * m8,
        0.5 * m9,
        0.25 * m12,
        0.5 * m13,
        0.25 * m14,
    )
    rhs[0], rhs[1], rhs[2], rhs[3], rhs[4], rhs[5] = r0, r1, r2, 0.5 * r3, r4, 0.5 * r5
    return m1 / m0, m2 / m0


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _residuals(s, t, h, w, e, n, known, quadratic, scale, x, first):
    """Return the weighted mean squared residual, the number of inliers, and the height's variance per unit variance.

    `x` is the solution, `first` the first column of the inverse; the weights are those of the solution.
    """
    x0, x1, x2, x3, x4, x5 = x[0], x[1], x[2], 0.5 * x[3], x[4], 0.5 * x[5]
    f0, f1, f2, f3, f4, f5 = first[0], first[1], first[2], 0.5 * first[3], first[4], 0.5 * first[5]
    b3, b4, b5 = 0.5 * quadratic[0], quadratic[1], 0.5 * quadratic[2]
    inverse = 1.0 / scale
    squares = weights = gain = used = 0.0
    for i in range(n):
        a, b, c = s[i], t[i], h[i]
        aa, ab, bb = a * a, a * b, b * b
        q = (c - b3 * aa - b4 * ab - b5 * bb) * inverse
        q = max(1.0 - q * q, 0.0)
        q *= q
        r = c - x0 - x1 * a - x2 * b - x3 * aa - x4 * ab - x5 * bb
        squares += q * r * r
        weights += q
        used += 1.0 if q > 0.0 else 0.0
        g = w[i] * q * (f0 + f1 * a + f2 * b + f3 * aa + f4 * ab + f5 * bb)
        gain += g * g * (e[i] if known else 1.0)
    return squares / weights, used, gain


@njit(cache=True, error_model="numpy")
def _solve_quadric(m, rhs, first, used):
    """Solve the normal equations, for a plane if a quadric is underdetermined; return the number of unknowns."""
    keep = (m[0, 0], m[1, 0], m[2, 0], m[1, 1], m[2, 1], m[2, 2], rhs[0], rhs[1], rhs[2])
    if used >= 9 and solve(m, 6, rhs, first):
        return 6
    m[0, 0], m[1, 0], m[2, 0], m[1, 1], m[2, 1], m[2, 2], rhs[0], rhs[1], rhs[2] = keep
    rhs[3:] = 0.0
    first[3:] = 0.0
    return 3 if used >= 3 and solve(m, 3, rhs, first) else 0


@njit(cache=True, error_model="numpy")
def _robust_deviation(s, t, h, n, x, size, work):
    """Return a robust standard deviation of the residuals, from their median absolute value."""
    for i in range(n):
        a, b = s[i], t[i]
        r = h[i] - x[0] - x[1] * a - x[2] * b - 0.5 * x[3] * a * a - x[4] * a * b - 0.5 * x[5] * b * b
        work[i] = abs(r)
    return 1.4826 * median(work, n) * n / max(n - size, 1)


@njit(cache=True, error_model="numpy")
def fit(points, spread, members, count, radius, iterations, noise, surfel, report, work):
    """Fit a quadric to the members around `surfel` (initial point and normal), in place; return False if none fits.

    `spread` (n, 3) or (0, 3): one standard deviation of each point's error along one known direction; members are then
    weighted by the inverse variance along the normal. Weights fall as 1 - t^2 with the tangential distance t in radii.
    With `noise` 0 the first iteration is ordinary least squares and the others use Tukey weights; with the noise known
    and `surfel` already a fit, all do. The frame follows the fit from iteration to iteration. `work` is (6, any)
    scratch.
    """
    m = np.zeros((6, 6))
    x = np.zeros(6)
    first = np.zeros(6)
    u = np.zeros(3)
    v = np.zeros(3)
    quadratic = np.zeros(3)
    s, t, h, w, e, rest = work[0], work[1], work[2], work[3], work[4], work[5]
    known = len(spread) > 0
    tangents(surfel[3], surfel[4], surfel[5], u, v)
    start0, start1, start2 = surfel[0], surfel[1], surfel[2]
    inverse = 1.0 / radius
    scale = 1e6
    if noise > 0.0:
        scale = TUKEY * noise * inverse
        quadratic[0], quadratic[1], quadratic[2] = (
            bilinear_form(surfel, u, u) * radius,
            bilinear_form(surfel, u, v) * radius,
            bilinear_form(surfel, v, v) * radius,
        )
    length = 1.0
    for _ in range(iterations):
        n = _local_coordinates(points, spread, members, count, surfel, u, v, inverse, s, t, h, w, e)
        if n < 3:
            return False
        center_s, center_t = _normal_equations(s, t, h, w, n, quadratic, scale, m, x)
        size = _solve_quadric(m, x, first, n)
        if size == 0 or not (abs(x[0]) < 1.5 and abs(x[1]) < 2.0 and abs(x[2]) < 2.0):
            return False
        square, used, gain = _residuals(s, t, h, w, e, n, known, quadratic, scale, x, first)
        free = max(used - size, 1.0) / used
        if scale >= 1e6:
            sigma = _robust_deviation(s, t, h, n, x, size, rest)
        else:
            sigma = math.sqrt(square / free)
            for _step in range(3):  # corrects for the truncated tails of a Gaussian
                c = max(scale / max(sigma, 1e-12), 3.0) ** -2
                sigma = math.sqrt(square / free * (1.0 - 2.0 * c + 3.0 * c * c) / (1.0 - 6.0 * c + 15.0 * c * c))
        scale = TUKEY * max(sigma, 1e-6)
        quadratic[0], quadratic[1], quadratic[2] = x[3], x[4], x[5]
        length = 1.0 / math.sqrt(1.0 + x[1] * x[1] + x[2] * x[2])
        for k in range(3):
            surfel[k] += radius * x[0] * surfel[3 + k]
        for k in range(3):
            surfel[3 + k] = (surfel[3 + k] - x[1] * u[k] - x[2] * v[k]) * length
        align_tangents(surfel, u, v)
        report[NOISE] = sigma * radius
        report[VARIANCE] = (gain if known else gain * sigma * sigma) * radius * radius
        report[COUNT] = used
        report[ECCENTRICITY] = math.sqrt(center_s * center_s + center_t * center_t)
    report[OFFSET] = (
        (surfel[0] - start0) * surfel[3] + (surfel[1] - start1) * surfel[4] + (surfel[2] - start2) * surfel[5]
    )
    report[CURVATURE] = math.sqrt(quadratic[0] ** 2 + 2.0 * quadratic[1] ** 2 + quadratic[2] ** 2) * inverse * length
    set_form(
        surfel, u, v, quadratic[0] * inverse * length, quadratic[1] * inverse * length, quadratic[2] * inverse * length
    )
    return True
