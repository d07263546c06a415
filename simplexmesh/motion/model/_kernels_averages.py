"""Kernels over the one-ring: averages (s passes: over Q^s), folds, and curvature-adapted metric parameters."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import FAST
from simplexmesh._base._kernels_rows import SHARED_FROM, by_rows


@by_rows(10 * SHARED_FROM, fastmath=FAST)  # less than a nanosecond per vertex
def averages(begin, end, values, neighbors, out):
    """Fill `out` with the mean of each vertex's value and its three neighbors': a positive kernel on Q^1."""
    for i in range(begin, end):
        out[i] = 0.25 * (values[i] + values[neighbors[i, 0]] + values[neighbors[i, 1]] + values[neighbors[i, 2]])


@by_rows(fastmath=FAST)
def angle_averages(begin, end, values, neighbors, inverse_radius, out):
    """Fill the mean simplex angle over the one-ring, angles converted to the vertex's circumradius as on one sphere."""
    for i in range(begin, end):
        total = values[i]
        for k in range(3):
            j = neighbors[i, k]
            if inverse_radius[i] > 0.0 and inverse_radius[j] > 0.0:
                sine = math.sin(values[j]) * inverse_radius[j] / inverse_radius[i]
                angle = math.asin(min(max(sine, -1.0), 1.0))
                if abs(values[j]) > 0.5 * math.pi:
                    angle = math.copysign(math.pi, values[j]) - angle
                total += angle
            else:
                total += values[j]
        out[i] = 0.25 * total


@by_rows(fastmath=FAST)
def released(begin, end, normals, neighbors, gaps, rings, before, out):
    """Fill `rings` where a vertex is folded; where it has no data one less than was `before` beside it; else zero."""
    for i in range(begin, end):
        a, b, c = neighbors[i, 0], neighbors[i, 1], neighbors[i, 2]
        agreement = 0.0
        for k in range(3):
            agreement += normals[i, k] * (normals[a, k] + normals[b, k] + normals[c, k])
        if not agreement > 0.0:
            out[i] = rings
        elif gaps[i] != gaps[i]:
            out[i] = max(before[a], before[b], before[c], 1) - 1
        else:
            out[i] = 0


@by_rows(fastmath=FAST)
def curvedness(begin, end, vertices, normals, neighbors, shortest, out):
    """Fill the root mean square over the neighbors of the change of normal per edge length, at least `shortest`."""
    for i in range(begin, end):
        total = 0.0
        for j in range(3):
            k = neighbors[i, j]
            x, y, z = vertices[k, 0] - vertices[i, 0], vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
            a, b, c = normals[k, 0] - normals[i, 0], normals[k, 1] - normals[i, 1], normals[k, 2] - normals[i, 2]
            length2 = max(x * x + y * y + z * z, shortest * shortest)
            total += (a * a + b * b + c * c) / length2 if length2 > 0.0 else 0.0
        out[i] = math.sqrt(total / 3.0)


@by_rows(fastmath=FAST)
def adapted(begin, end, metric, size, floor, neighbors, strength, lowest, highest, out):
    """Fill the mean of `metric` and ``1/3 + strength dC_j``, `strength` reduced to keep this in lowest..highest."""
    for i in range(begin, end):
        a, b, c = abs(size[neighbors[i, 0]]), abs(size[neighbors[i, 1]]), abs(size[neighbors[i, 2]])
        mean = (a + b + c) / 3.0
        scale = 1.0 / max(abs(size[i]), floor)
        a, b, c = (a - mean) * scale, (b - mean) * scale, (c - mean) * scale
        share = strength
        most, least = max(a, b, c), min(a, b, c)
        if most > 0.0:
            share = min(share, (highest - 1.0 / 3.0) / most)
        if least < 0.0:
            share = min(share, (lowest - 1.0 / 3.0) / least)
        out[i, 0] = 0.5 * (metric[i, 0] + 1.0 / 3.0 + share * a)
        out[i, 1] = 0.5 * (metric[i, 1] + 1.0 / 3.0 + share * b)
        out[i, 2] = 0.5 * (metric[i, 2] + 1.0 / 3.0 + share * c)
