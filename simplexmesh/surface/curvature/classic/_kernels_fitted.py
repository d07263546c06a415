"""Forms of curvature fitted by least squares: quadrics (McIvor and Valkenburg 1997), circles (Chen and Schmitt 1992).

As in `_kernels_euler`; quadrics also return the slopes of the surface in the frame.
"""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import njit
from simplexmesh.numerics._kernels_matrices import DEPENDENT, add_row, independence, substituted
from simplexmesh.surface._kernels_circles import STRAIGHT, circle, opposite_pairs
from simplexmesh.surface._kernels_fan import FLAT, SINGULAR

SIMPLE, EXTENDED, FULL = 3, 5, 6
"""Terms of the three quadrics."""

OFFSET = 0.25
"""The offset f is zero where its column is less independent of the others than this."""


@njit(cache=True, error_model="numpy")
def quadric(fan, count, terms, least, factor):
    """Fit z = a u^2 + b u v + c v^2 (+ d u + e v (+ f)); the form is that where the surface meets the normal line."""
    distinct = 0
    factor[:] = 0.0
    for m in range(count):
        if fan[m, 3] > 0.0:
            distinct += 1
            u, v = fan[m, 0], fan[m, 1]
            factor[terms, 0], factor[terms, 1], factor[terms, 2] = u * u, u * v, v * v
            if terms >= EXTENDED:
                factor[terms, 3], factor[terms, 4] = u, v
            if terms == FULL:
                factor[terms, 5] = 1.0
            factor[terms, terms] = fan[m, 2]
            add_row(factor, terms)
    if distinct < least:
        return math.nan, 0.0, 0.0, 0.0, 0.0
    for j in range(min(terms, EXTENDED)):
        if independence(factor, j) < DEPENDENT:
            return math.nan, 0.0, 0.0, 0.0, 0.0
    substituted(factor, terms, EXTENDED if terms == FULL and independence(factor, 5) < OFFSET else terms)
    a, b, c = factor[terms, 0], factor[terms, 1], factor[terms, 2]
    d, e = (factor[terms, 3], factor[terms, 4]) if terms >= EXTENDED else (0.0, 0.0)
    first, g, cross = 1.0 + d * d, 1.0 + d * d + e * e, d * e
    root = math.sqrt(g)
    # minus the second fundamental form on the tangents (1, 0, d) and (-d e, 1 + d^2, e), normalized
    p = -2.0 * a / (root * first)
    q = (2.0 * cross * a - first * b) / (g * first)
    r = -2.0 * (cross * cross * a - cross * first * b + first * first * c) / (g * root * first)
    return p, q, r, d, e


@njit(cache=True, error_model="numpy")
def circles(fan, count, weighted, normalized, factor, opposed):
    """Fit A c^2 + B c s + C s^2 = k to circles through opposite neighbors, weighted by 1 / |k| or not (2.33-2.38)."""
    pairs, oppositions = opposed
    kept, scale = opposite_pairs(fan, count, normalized, pairs, oppositions)
    factor[:] = 0.0
    sc = ss = scc = sss = scs = 0.0
    used, straight = 0, False
    for pair in range(kept):
        k, u, v, w = circle(fan, pairs[pair, 0], pairs[pair, 1])
        flat = u * u + v * v
        if flat <= FLAT * (flat + w * w):
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
        return math.nan, 0.0, 0.0
    factor[3] = 0.0
    if not (weighted and straight):  # a straight line has infinite weight, and requires k = 0
        substituted(factor, 3, 3)
    return factor[3, 0] / scale, 0.5 * factor[3, 1] / scale, factor[3, 2] / scale
