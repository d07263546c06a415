"""Neighbors across from each other, as Chen and Schmitt choose them for normals and for curvatures."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._kernels_njit import njit

TIED = 1e-9
"""Oppositions that differ by a smaller share of the largest are the same: rounding must not choose between them."""


@njit(cache=True, error_model="numpy")
def arms_of(points, i, members, start, stop, arms):
    """Fill the (x, y, z, length) of the neighbors away from point i, over their mean distance; return both."""
    count, total = 0, 0.0
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            arms[count, 0], arms[count, 1], arms[count, 2], arms[count, 3] = x, y, z, length
            count += 1
            total += length
    scale = total / max(count, 1)
    arms[:count] /= scale
    return count, scale


@njit(cache=True, error_model="numpy")
def most_opposed(arms, count, normalized, triples, oppositions):
    """Fill the `count` pairs of neighbors most across from each other; of equals, those first in order."""
    widest = 0.0
    for a in range(count):
        widest = max(widest, 1.0 if normalized else arms[a, 3] * arms[a, 3])
    kept = 0
    for a in range(count):
        for b in range(a + 1, count):
            across = -(arms[a, 0] * arms[b, 0] + arms[a, 1] * arms[b, 1] + arms[a, 2] * arms[b, 2])
            if normalized:
                across /= arms[a, 3] * arms[b, 3]
            if kept == count and across <= oppositions[kept - 1] + TIED * widest:
                continue
            place = min(kept, count - 1)
            while place > 0 and across > oppositions[place - 1] + TIED * widest:
                oppositions[place] = oppositions[place - 1]
                triples[place, 0], triples[place, 1] = triples[place - 1, 0], triples[place - 1, 1]
                place -= 1
            oppositions[place], triples[place, 0], triples[place, 1] = across, a, b
            kept = min(kept + 1, count)
    return kept
