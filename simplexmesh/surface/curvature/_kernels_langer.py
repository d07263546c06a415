"""Langer's quadratures: weights from the tangents of the angles between neighbors, exact for Euler's formula."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_frames import tangents
from simplexmesh.surface.curvature._kernels_solve import FLAT, principal
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

MANY = 64
"""More neighbors than this are sorted by `argsort`, fewer by insertion."""

RIGHT = 1e-6
"""Angles whose cosine is less are right: their tangents exceed all others, and only their weights remain."""

CANCELED = 1e-9
"""Weights whose sum is less than this share of their absolute sum cancel."""

SINGULAR = 1e-10
"""Scatter determinant of the doubled azimuths, per squared count, below which there are only two directions."""

UNSTABLE = 0.02
"""Least squares replace the second quadrature where the sum of its weights is less than this share of their size."""


@njit(cache=True, error_model="numpy")
def _sections(points, i, members, start, stop, normal, sections):
    """Fill (azimuth, normal curvature, cos, sin) per neighbor that has an azimuth, in order; return how many."""
    nx, ny, nz = normal
    ux, uy, uz, vx, vy, vz = tangents(nx, ny, nz)
    count = 0
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        square = x * x + y * y + z * z
        u, v = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
        flat = u * u + v * v
        if flat <= FLAT * square:
            continue
        azimuth, place, length = math.atan2(v, u), count, math.sqrt(flat)
        while place > 0 and stop - start <= MANY and sections[place - 1, 0] > azimuth:
            sections[place] = sections[place - 1]
            place -= 1
        sections[place, 0], sections[place, 1] = azimuth, -2.0 * (nx * x + ny * y + nz * z) / square
        sections[place, 2], sections[place, 3] = u / length, v / length
        count += 1
    if stop - start > MANY:
        sections[:count] = sections[np.argsort(sections[:count, 0])]
    return count


@njit(cache=True, error_model="numpy")
def _set_weights(sections, count, times, least, weights):
    """Fill weights of sum 1 for which the mean of e^(2 i times azimuth) is 0; return False where they cancel."""
    right = False
    for pass_ in range(2):  # again if there are right angles, whose tangents exceed the others
        sums = sizes = 0.0
        weights[:count] = 0.0
        for a in range(count):
            b = a + 1 if a + 1 < count else 0
            gap = times * (sections[b, 0] - sections[a, 0] + (0.0 if b else 2.0 * math.pi))
            is_right = abs(math.cos(gap)) < RIGHT
            right = right or is_right
            tangent = 1.0 if is_right else (0.0 if pass_ else math.tan(gap))
            weights[a] += tangent
            weights[b] += tangent
        if not right:
            break
    for a in range(count):
        sums += weights[a]
        sizes += abs(weights[a])
    if sizes < CANCELED or abs(sums) < least * sizes:
        return False
    for a in range(count):
        weights[a] /= sums
    return True


@njit(cache=True, error_model="numpy")
def _tensor(sections, count, weights):
    """Return mean, amplitude and direction of Taubin's tensor with these weights."""
    a = b = c = 0.0
    for s in range(count):
        k, x, y = weights[s] * sections[s, 1], sections[s, 2], sections[s, 3]
        a += k * x * x
        b += k * x * y
        c += k * y * y
    mean, amplitude, cosine, sine = principal(a, b, c)
    return 2.0 * mean, 4.0 * amplitude, cosine, sine


@njit(cache=True, error_model="numpy")
def _quadrature(sections, count, weights):
    """Return mean, amplitude and direction by two quadratures; the amplitude is NaN where directions are too few."""
    mean = a = b = cc = cs = ss = 0.0
    for s in range(count):
        mean += weights[s] * sections[s, 1]
    exact = _set_weights(sections, count, 2.0, UNSTABLE, weights)
    for s in range(count):
        x, y = sections[s, 2], sections[s, 3]
        c, d = x * x - y * y, 2.0 * x * y
        k = (weights[s] if exact else 1.0) * (sections[s, 1] - mean)
        a += 2.0 * k * c
        b += 2.0 * k * d
        cc, cs, ss = cc + c * c, cs + c * d, ss + d * d
    if not exact:
        det = 2.0 * (cc * ss - cs * cs)
        if det <= SINGULAR * count * count:
            return mean, math.nan, 1.0, 0.0
        a, b = (a * ss - b * cs) / det, (b * cc - a * cs) / det
    half = 0.5 * math.atan2(b, a)
    return mean, math.sqrt(a * a + b * b), math.cos(half), math.sin(half)


@Both
def langer(centers, offsets, members, points, normals, exact, k1, k2, d1, reasons):
    """Fill curvatures per row, from Taubin's tensor or two quadratures (Langer, Belyaev, Seidel 2007)."""
    for row in prange(centers.shape[0]):
        start, stop = offsets[row], offsets[row + 1]
        normal = normals[row, 0], normals[row, 1], normals[row, 2]
        size = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]
        if stop - start < 3 or size < 0.5:
            reasons[row] = FEW if stop - start < 3 else DEGENERATE
            continue
        sections, weights = np.empty((stop - start, 4)), np.empty(stop - start)
        count = _sections(points, centers[row], members, start, stop, normal, sections)
        if count < 3 or not _set_weights(sections, count, 1.0, CANCELED, weights):
            reasons[row] = DEGENERATE
            continue
        if exact:
            mean, amplitude, cosine, sine = _quadrature(sections, count, weights)
        else:
            mean, amplitude, cosine, sine = _tensor(sections, count, weights)
        if math.isnan(amplitude):
            reasons[row] = DEGENERATE
            continue
        ux, uy, uz, vx, vy, vz = tangents(normal[0], normal[1], normal[2])
        k1[row], k2[row] = mean + amplitude, mean - amplitude
        d1[row, 0], d1[row, 1] = cosine * ux + sine * vx, cosine * uy + sine * vy
        d1[row, 2] = cosine * uz + sine * vz
        reasons[row] = FOUND
