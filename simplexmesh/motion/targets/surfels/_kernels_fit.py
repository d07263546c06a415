"""One robust quadratic fit to the points around a place.

A surfel is a row of numbers: 0-2 a point on the fit, 3-5 its unit normal, 6-11 the second-order form Q as
(xx, yy, zz, xy, xz, yz), so that ``normal . d - d' Q d / 2`` is the height of ``point + d`` above the fit.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.numerics._kernels_matrices import solve
from simplexmesh.numerics._kernels_tree import select
from simplexmesh.numerics._kernels_vectors import assign, cross_product, dot, minus, row, unit
from simplexmesh.numerics.robust import NORMAL_MAD

MAX_POINTS = 2048  # per fit; larger neighborhoods are subsampled
VARIANCE_FLOOR = 0.04  # isotropic part of the variance of known errors
TUKEY = 4.685  # cutoff of Tukey's weights, in standard deviations: 95 % efficient on Gaussian errors
UNBOUNDED = 1e6  # cutoff, in radii, of ordinary least squares
POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # of s and t: the basis 1, s, t, s^2, s t, t^2


class Cloud(NamedTuple):
    """Points to be described by surfels, and their tree; `normals` and `spread` may be empty, (0, 3)."""

    points: Array  # (n, 3), as the next three those of a `kd_tree.Tree`: kernels cannot take nested tuples
    starts: Indices
    ends: Indices
    boxes: Array
    normals: Array  # (n, 3) oriented
    spread: Array  # (n, 3) one standard deviation of each point's error, along one known direction


class Local(NamedTuple):
    """Members of a neighborhood, and those within the radius in the surfel's frame, in radii; scratch memory."""

    members: Indices
    s: Array  # tangential coordinates
    t: Array
    h: Array  # height
    w: Array  # weight, without that of robustness
    e: Array  # known variance of the height; 1 if it is unknown
    rest: Array
    order: Indices


class Goodness(NamedTuple):
    """How well a fit describes the points, all NaN if there is none; or arrays of these."""

    offset: float  # of the fit from the place, along its normal
    variance: float  # of the offset
    noise: float  # standard deviation of the points along the normal
    used: float  # points, outliers not counted
    eccentricity: float  # tangential distance of their weighted center, in radii: large at a border
    curvature: float  # root of the sum of the squared principal curvatures


NO_FIT = Goodness(math.nan, math.nan, math.nan, math.nan, math.nan, math.nan)


@njit(cache=True, error_model="numpy")
def new_local():
    """Return memory for the largest neighborhood."""
    work = np.empty((6, MAX_POINTS))
    members, order = np.empty(MAX_POINTS, np.int64), np.empty(MAX_POINTS, np.int64)
    return Local(members, work[0], work[1], work[2], work[3], work[4], work[5], order)


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _set_coordinates(cloud, local, count, surfel, frame, radius):
    """Fill the coordinates and weights of the members within the radius; return their number."""
    points, spread = cloud.points, cloud.spread
    u, v, normal = frame
    center = surfel[0], surfel[1], surfel[2]
    inverse = 1.0 / radius
    n = 0
    for i in range(count):
        p = local.members[i]
        d = minus(row(points, p), center)
        a, b, c = dot(d, u) * inverse, dot(d, v) * inverse, dot(d, normal) * inverse
        weight = 1.0 - a * a - b * b
        if weight <= 0.0 or abs(c) > 1.0:
            continue
        local.s[n], local.t[n], local.h[n], local.w[n], local.e[n] = a, b, c, weight, 1.0
        if len(spread) > 0:
            error = row(spread, p)
            whole = dot(error, error) * inverse * inverse
            local.e[n] = (dot(error, normal) * inverse) ** 2 + VARIANCE_FLOOR * whole
            local.w[n] *= whole / local.e[n]
        n += 1
    return n


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _tukey(residual, cutoff):
    """Return Tukey's biweight of a residual."""
    q = residual / cutoff
    q = max(1.0 - q * q, 0.0)
    return q * q


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _height(x, a, b):
    """Return the height of the quadric with coefficients `x` (6,) at tangential coordinates."""
    return x[0] + x[1] * a + x[2] * b + x[3] * a * a + x[4] * a * b + x[5] * b * b


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _normal_equations(local, n, bend, cutoff, m, rhs):
    """Fill the normal equations of a quadric, with Tukey weights about `bend`; return how far off their center is."""
    m0 = m1 = m2 = m3 = m4 = m5 = m6 = m7 = m8 = m9 = m10 = m11 = m12 = m13 = m14 = 0.0
    r0 = r1 = r2 = r3 = r4 = r5 = 0.0
    for i in range(n):
        a, b, c = local.s[i], local.t[i], local.h[i]
        x = local.w[i] * _tukey(c - bend[3] * a * a - bend[4] * a * b - bend[5] * b * b, cutoff)
        xa, xb, xc = x * a, x * b, x * c
        xaa, xab, xbb = xa * a, xa * b, xb * b
        m0, m1, m2, m3, m4, m5 = m0 + x, m1 + xa, m2 + xb, m3 + xaa, m4 + xab, m5 + xbb
        m6, m7, m8, m9 = m6 + xaa * a, m7 + xaa * b, m8 + xab * b, m9 + xbb * b
        aa, ab, bb = a * a, a * b, b * b
        m10, m11, m12, m13, m14 = m10 + xaa * aa, m11 + xaa * ab, m12 + xaa * bb, m13 + xab * bb, m14 + xbb * bb
        r0, r1, r2, r3, r4, r5 = r0 + xc, r1 + xc * a, r2 + xc * b, r3 + xc * aa, r4 + xc * ab, r5 + xc * bb
    moments = m0, m1, m2, m3, m4, m5, m6, m7, m8, m9, m10, m11, m12, m13, m14  # of a^p b^q, by p + q, then q
    sums = r0, r1, r2, r3, r4, r5
    for j in range(6):
        rhs[j] = sums[j]
        for k in range(j + 1):
            q = POWERS[j][1] + POWERS[k][1]
            degree = POWERS[j][0] + POWERS[k][0] + q
            m[j, k] = moments[degree * (degree + 1) // 2 + q]
    return math.sqrt(m1 * m1 + m2 * m2) / m0


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _residuals(local, n, bend, cutoff, x, first):
    """Return the weighted mean squared residual, the number of inliers, and the height's variance per unit variance."""
    squares = weights = gain = used = 0.0
    for i in range(n):
        a, b, c = local.s[i], local.t[i], local.h[i]
        q = _tukey(c - bend[3] * a * a - bend[4] * a * b - bend[5] * b * b, cutoff)
        r = c - _height(x, a, b)
        squares += q * r * r
        weights += q
        used += 1.0 if q > 0.0 else 0.0
        g = local.w[i] * q * _height(first, a, b)
        gain += g * g * local.e[i]
    return squares / weights, used, gain


@njit(cache=True, error_model="numpy")
def _solve_quadric(m, rhs, first, used):
    """Solve for `rhs` and column 0 of the inverse, of a plane if a quadric is underdetermined; return the unknowns."""
    for unknowns, least in ((6, 9), (3, 3)):
        factor, x = m.copy(), rhs.copy()
        determined = used >= least and solve(factor, x, unknowns)
        for j in range(unknowns):
            determined &= factor[j, j] ** 2 * m[j, j] < 1e3  # the diagonal is inverted
        if determined:
            rhs[:] = first[:] = 0.0
            assign(rhs[:unknowns], x)
            first[0] = 1.0
            solve(m, first, unknowns)
            return unknowns
    return 0


@njit(cache=True, error_model="numpy")
def _deviation(local, n, x, unknowns, cutoff, square, used):
    """Return the standard deviation of the residuals: from their median, or corrected for the tails that were cut."""
    if cutoff >= UNBOUNDED:
        for i in range(n):
            local.rest[i], local.order[i] = abs(local.h[i] - _height(x, local.s[i], local.t[i])), i
        select(local.rest, local.order, 0, n, n // 2)
        return NORMAL_MAD * local.rest[local.order[n // 2]] * n / max(n - unknowns, 1)
    square *= used / max(used - unknowns, 1.0)
    sigma = math.sqrt(square)
    for _ in range(3):  # Gaussian errors assumed
        c = max(cutoff / max(sigma, 1e-12), 3.0) ** -2
        sigma = math.sqrt(square * (1.0 - 2.0 * c + 3.0 * c * c) / (1.0 - 6.0 * c + 15.0 * c * c))
    return sigma


@njit(cache=True, error_model="numpy")
def _bilinear(surfel, u, v):
    """Return u' Q v for the surfel's second-order form Q."""
    return (
        surfel[6] * u[0] * v[0]
        + surfel[7] * u[1] * v[1]
        + surfel[8] * u[2] * v[2]
        + surfel[9] * (u[0] * v[1] + u[1] * v[0])
        + surfel[10] * (u[0] * v[2] + u[2] * v[0])
        + surfel[11] * (u[1] * v[2] + u[2] * v[1])
    )


@njit(cache=True, error_model="numpy")
def _set_form(surfel, u, v, bend, scale):
    """Set the surfel's second-order form from the coefficients of a quadric over the tangents `u`, `v`."""
    uu, uv, vv = 2.0 * scale * bend[3], scale * bend[4], 2.0 * scale * bend[5]
    for k, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        surfel[6 + k] = uu * u[a] * u[b] + uv * (u[a] * v[b] + u[b] * v[a]) + vv * v[a] * v[b]


@njit(cache=True, error_model="numpy")
def fit(cloud, local, count, radius, noise, surfel):
    """Fit a quadric to the members around `surfel`, in place: by least squares if `noise` is 0, then robustly."""
    m, x, first, bend = np.zeros((6, 6)), np.zeros(6), np.zeros(6), np.zeros(6)
    start, normal = (surfel[0], surfel[1], surfel[2]), (surfel[3], surfel[4], surfel[5])
    u0, u1, u2, v0, v1, v2 = tangents(normal[0], normal[1], normal[2])
    u, v = (u0, u1, u2), (v0, v1, v2)
    cutoff = UNBOUNDED
    if noise > 0.0:
        cutoff = TUKEY * noise / radius
        bend[3], bend[5] = 0.5 * radius * _bilinear(surfel, u, u), 0.5 * radius * _bilinear(surfel, v, v)
        bend[4] = radius * _bilinear(surfel, u, v)
    length, sigma, gain, used, center = 1.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(1 if noise > 0.0 else 2):
        n = _set_coordinates(cloud, local, count, surfel, (u, v, normal), radius)
        if n < 3:
            return NO_FIT
        center = _normal_equations(local, n, bend, cutoff, m, x)
        unknowns = _solve_quadric(m, x, first, n)
        if unknowns == 0 or not (abs(x[0]) < 1.5 and abs(x[1]) < 2.0 and abs(x[2]) < 2.0):
            return NO_FIT
        square, used, gain = _residuals(local, n, bend, cutoff, x, first)
        sigma = _deviation(local, n, x, unknowns, cutoff, square, used)
        cutoff = TUKEY * max(sigma, 1e-6)
        assign(bend[3:], x[3:])
        length = 1.0 / math.sqrt(1.0 + x[1] * x[1] + x[2] * x[2])
        for k in range(3):
            surfel[k] += radius * x[0] * normal[k]
            surfel[3 + k] = (normal[k] - x[1] * u[k] - x[2] * v[k]) * length
        normal = surfel[3], surfel[4], surfel[5]
        along = dot(u, normal)
        u = unit((u[0] - along * normal[0], u[1] - along * normal[1], u[2] - along * normal[2]))
        v = cross_product(normal, u)
    _set_form(surfel, u, v, bend, length / radius)
    return Goodness(
        dot((surfel[0] - start[0], surfel[1] - start[1], surfel[2] - start[2]), normal),
        (gain if len(cloud.spread) > 0 else gain * sigma * sigma) * radius * radius,
        sigma * radius,
        used,
        center,
        math.sqrt(4.0 * bend[3] ** 2 + 2.0 * bend[4] ** 2 + 4.0 * bend[5] ** 2) * length / radius,
    )
