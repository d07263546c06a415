"""Pairs of opposite neighbors, as Chen and Schmitt select them for normals and curvatures."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._kernels_njit import njit

TIED = 1e-9
"""Oppositions that differ by less than this share of the largest are tied: rounding must not decide between them."""


@njit(cache=True, error_model="numpy")
def edge_vectors(points, i, members, start, stop, edges):
    """Fill (x, y, z, length) of the edges from point i, over their mean length; return their number and mean length."""
    count, total = 0, 0.0
    for m in range(start, stop):
        j = members[m]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            edges[count, 0], edges[count, 1], edges[count, 2], edges[count, 3] = x, y, z, length
            count += 1
            total += length
    scale = total / max(count, 1)
    edges[:count] /= scale
    return count, scale


@njit(cache=True, error_model="numpy")
def most_opposite(edges, count, normalized, pairs, oppositions):
    """Fill the `count` most opposite pairs of neighbors, ties in the order of the neighbors; return how many."""
    widest = 0.0
    for a in range(count):
        widest = max(widest, 1.0 if normalized else edges[a, 3] * edges[a, 3])
    kept = 0
    for a in range(count):
        for b in range(a + 1, count):
            across = -(edges[a, 0] * edges[b, 0] + edges[a, 1] * edges[b, 1] + edges[a, 2] * edges[b, 2])
            if normalized:
                across /= edges[a, 3] * edges[b, 3]
            if kept == count and across <= oppositions[kept - 1] + TIED * widest:
                continue
            place = min(kept, count - 1)
            while place > 0 and across > oppositions[place - 1] + TIED * widest:
                oppositions[place] = oppositions[place - 1]
                pairs[place, 0], pairs[place, 1] = pairs[place - 1, 0], pairs[place - 1, 1]
                place -= 1
            oppositions[place], pairs[place, 0], pairs[place, 1] = across, a, b
            kept = min(kept + 1, count)
    return kept
