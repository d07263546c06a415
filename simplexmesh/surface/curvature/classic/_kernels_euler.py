"""Euler's formula from the curvatures of circles through each neighbor that are tangent to the surface.

Each function reduces a fan to the form p x^2 + 2 q x y + r y^2 of normal curvatures; p is NaN where there is none.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import njit
from simplexmesh.surface._kernels_fan import FLAT, SINGULAR

NONE = (math.nan, 0.0, 0.0)

SPREAD = 1e-5
"""Scatter trace of the doubled azimuths, per count, below which there is only one direction."""

RIGHT = 1e-6
"""Angles whose cosine is less are right: their tangents exceed all others, and only their weights remain."""

CANCELED = 1e-9
"""Weights whose sum is less than this share of their absolute sum cancel."""

UNSTABLE = 0.02
"""Least squares replace the second quadrature where the sum of its weights is less than this share of their size."""


@njit(cache=True, error_model="numpy")
def sine(fan, count, least_swing):
    """Fit k = a cos 2 t + b sin 2 t + c by least squares (Charton 2014, 2.44)."""
    sc = ss = scc = sss = scs = sk = skc = sks = 0.0
    used = 0
    for m in range(count):
        u, v, square = fan[m, 0], fan[m, 1], fan[m, 3]
        flat = u * u + v * v
        if flat <= FLAT * square:
            continue
        k, c, s = -2.0 * fan[m, 2] / square, (u * u - v * v) / flat, 2.0 * u * v / flat
        used += 1
        sc += c
        ss += s
        scc += c * c
        sss += s * s
        scs += c * s
        sk += k
        skc += k * c
        sks += k * s
    if used < 3:
        return NONE
    w = 1.0 / used
    scc, sss, scs = scc - w * sc * sc, sss - w * ss * ss, scs - w * sc * ss
    skc, sks = skc - w * sk * sc, sks - w * sk * ss
    det = scc * sss - scs * scs
    if det > SINGULAR * used * used:
        a, b = (skc * sss - sks * scs) / det, (sks * scc - skc * scs) / det
    elif least_swing and scc + sss > SPREAD * used:  # the solution of minimum norm
        turn = 0.5 * math.atan2(2.0 * scs, scc - sss)
        c, s = math.cos(turn), math.sin(turn)
        along = (skc * c + sks * s) / (scc * c * c + 2.0 * scs * c * s + sss * s * s)
        a, b = along * c, along * s
    else:
        return NONE
    mean = w * (sk - a * sc - b * ss)
    return mean + a, b, mean - a


@njit(cache=True, error_model="numpy")
def taubin(fan, count, closed):
    """Return the form 4 M - tr M of Taubin's tensor M = sum w k T T^t; w are areas of faces, equal if not `closed`."""
    total = suu = suv = svv = tuu = tuv = tvv = 0.0
    used, after = 0, _doubled_area(fan, count - 1, 0) if closed else 0.5
    for m in range(count):
        u, v, height, square = fan[m, 0], fan[m, 1], fan[m, 2], fan[m, 3]
        flat, before = u * u + v * v, after
        if closed:
            after = _doubled_area(fan, m, m + 1 if m + 1 < count else 0)
        if flat <= FLAT * square:
            continue
        weight = before + after
        used += 1
        k = -2.0 * height / square
        uu, uv, vv = u * u / flat, u * v / flat, v * v / flat
        suu += uu
        suv += uv
        svv += vv
        total += weight
        tuu += weight * k * uu
        tuv += weight * k * uv
        tvv += weight * k * vv
    if used < 3 or total == 0.0 or suu * svv - suv * suv <= SINGULAR * used * used:
        return NONE
    return (3.0 * tuu - tvv) / total, 4.0 * tuv / total, (3.0 * tvv - tuu) / total


@njit(cache=True, error_model="numpy")
def _doubled_area(fan, a, b):
    """Return twice the area of the face between two neighbors."""
    x = fan[a, 1] * fan[b, 2] - fan[a, 2] * fan[b, 1]
    y = fan[a, 2] * fan[b, 0] - fan[a, 0] * fan[b, 2]
    z = fan[a, 0] * fan[b, 1] - fan[a, 1] * fan[b, 0]
    return math.sqrt(x * x + y * y + z * z)


@njit(cache=True, error_model="numpy")
def langer(fan, count, exact, sections):
    """Return the form of Taubin's tensor or, if `exact`, two quadratures, weighted by tangents of angles."""
    count = _ordered(fan, count, sections)
    if count < 3 or not _set_weights(sections, count, 1.0, CANCELED):
        return NONE
    if exact:
        return _quadrature(sections, count)
    a = b = c = 0.0
    for m in range(count):
        k, x, y = sections[m, 4] * sections[m, 1], sections[m, 2], sections[m, 3]
        a += k * x * x
        b += k * x * y
        c += k * y * y
    return 3.0 * a - c, 4.0 * b, 3.0 * c - a


@njit(cache=True, error_model="numpy")
def _ordered(fan, count, sections):
    """Fill (azimuth, normal curvature, cos, sin, .) per neighbor that has an azimuth, by azimuth; return how many."""
    used = 0
    for m in range(count):
        u, v, square = fan[m, 0], fan[m, 1], fan[m, 3]
        flat = u * u + v * v
        if flat <= FLAT * square:
            continue
        azimuth, place, length = math.atan2(v, u), used, math.sqrt(flat)
        while place > 0 and sections[place - 1, 0] > azimuth:
            sections[place] = sections[place - 1]
            place -= 1
        sections[place, 0], sections[place, 1] = azimuth, -2.0 * fan[m, 2] / square
        sections[place, 2], sections[place, 3] = u / length, v / length
        used += 1
    return used


@njit(cache=True, error_model="numpy")
def _set_weights(sections, count, times, least):
    """Fill weights of sum 1 for which the mean of e^(2 i times azimuth) is 0; return False where they cancel."""
    right = False
    for pass_ in range(2):  # again if there are right angles, whose tangents exceed the others
        sums = sizes = 0.0
        sections[:count, 4] = 0.0
        for a in range(count):
            b = a + 1 if a + 1 < count else 0
            gap = times * (sections[b, 0] - sections[a, 0] + (0.0 if b else 2.0 * math.pi))
            is_right = abs(math.cos(gap)) < RIGHT
            right = right or is_right
            tangent = 1.0 if is_right else (0.0 if pass_ else math.tan(gap))
            sections[a, 4] += tangent
            sections[b, 4] += tangent
        if not right:
            break
    for a in range(count):
        sums += sections[a, 4]
        sizes += abs(sections[a, 4])
    if sizes < CANCELED or abs(sums) < least * sizes:
        return False
    for a in range(count):
        sections[a, 4] /= sums
    return True


@njit(cache=True, error_model="numpy")
def _quadrature(sections, count):
    """Return the form by two quadratures, the second for the difference of k1 and k2."""
    mean = a = b = cc = cs = ss = 0.0
    for m in range(count):
        mean += sections[m, 4] * sections[m, 1]
    exact = _set_weights(sections, count, 2.0, UNSTABLE)
    for m in range(count):
        x, y = sections[m, 2], sections[m, 3]
        c, s = x * x - y * y, 2.0 * x * y
        k = (sections[m, 4] if exact else 1.0) * (sections[m, 1] - mean)
        a += 2.0 * k * c
        b += 2.0 * k * s
        cc, cs, ss = cc + c * c, cs + c * s, ss + s * s
    if not exact:
        det = 2.0 * (cc * ss - cs * cs)
        if det <= SINGULAR * count * count:
            return NONE
        a, b = (a * ss - b * cs) / det, (b * cc - a * cs) / det
    return mean + a, b, mean - a
