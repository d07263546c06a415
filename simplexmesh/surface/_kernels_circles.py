"""Circles through a point and two opposite neighbors (Chen and Schmitt 1992), for normals and curvatures."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import njit

TIED = 1e-9
"""Oppositions that differ by less than this share of the largest are tied: rounding must not decide between them."""

STRAIGHT = 1e-11
"""A circle whose curvature times the neighbors' distance is less than this is a straight line."""


@njit(cache=True, error_model="numpy")
def opposite_pairs(fan, count, normalized, pairs, oppositions):
    """Divide the fan by its mean distance, fill its most opposite pairs; return how many, and that distance."""
    distinct, total = 0, 0.0
    for m in range(count):
        if fan[m, 3] > 0.0:
            total += math.sqrt(fan[m, 3])
            fan[distinct, 0], fan[distinct, 1], fan[distinct, 2] = fan[m, 0], fan[m, 1], fan[m, 2]
            fan[distinct, 3] = math.sqrt(fan[m, 3])
            distinct += 1
    if distinct < 3:
        return 0, 0.0
    scale, widest, kept = total / distinct, 1.0 if normalized else 0.0, 0
    for m in range(distinct):
        for column in range(4):
            fan[m, column] /= scale
        if not normalized:
            widest = max(widest, fan[m, 3] * fan[m, 3])
    for a in range(distinct):
        for b in range(a + 1, distinct):
            across = -(fan[a, 0] * fan[b, 0] + fan[a, 1] * fan[b, 1] + fan[a, 2] * fan[b, 2])
            if normalized:
                across /= fan[a, 3] * fan[b, 3]
            if kept == distinct and across <= oppositions[kept - 1] + TIED * widest:
                continue
            place = min(kept, distinct - 1)
            while place > 0 and across > oppositions[place - 1] + TIED * widest:
                oppositions[place] = oppositions[place - 1]
                pairs[place, 0], pairs[place, 1] = pairs[place - 1, 0], pairs[place - 1, 1]
                place -= 1
            oppositions[place], pairs[place, 0], pairs[place, 1] = across, a, b
            kept = min(kept + 1, distinct)
    return kept, scale


@njit(cache=True, error_model="numpy")
def circle(fan, a, b):
    """Return the normal curvature (Meusnier) of the circle through the center and two neighbors, and its tangent."""
    ax, ay, az, bx, by, bz = fan[a, 0], fan[a, 1], fan[a, 2], fan[b, 0], fan[b, 1], fan[b, 2]
    aa, bb = fan[a, 3] * fan[a, 3], fan[b, 3] * fan[b, 3]
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    cc = cx * cx + cy * cy + cz * cz
    tx, ty, tz = bx / bb - ax / aa, by / bb - ay / aa, bz / bb - az / aa
    if cc <= STRAIGHT * STRAIGHT * aa * bb:
        return 0.0, tx, ty, tz
    ox = (cy * az - cz * ay) * bb + (by * cz - bz * cy) * aa
    oy = (cz * ax - cx * az) * bb + (bz * cx - bx * cz) * aa
    oz = (cx * ay - cy * ax) * bb + (bx * cy - by * cx) * aa
    # center O = o / 2 cc, |O| = |o| / 2 cc: -(o / |o| . n) / |O|
    return -2.0 * cc * oz / (ox * ox + oy * oy + oz * oz), tx, ty, tz
