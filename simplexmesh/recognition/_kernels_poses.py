"""Motions of many models at once, from pairs of points that look alike. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.recognition._kernels_library import agreeing, two_likest

TOLD = 0.1
"""Normals of a pair tell a direction whose part across its line is longer than this."""


@njit(cache=True, error_model="numpy")
def unpack(places, directions, scale, low, points, normals):
    """Fill points, `places` times a scale from a corner, and unit normals along `directions`."""
    for i in range(len(places)):
        square = 0.0
        for a in range(3):
            points[i, a] = places[i, a] * scale + low[a]
            square += float(directions[i, a]) ** 2
        length = math.sqrt(square)
        for a in range(3):
            normals[i, a] = directions[i, a] / length if length > 0 else 0.0


@njit(cache=True, error_model="numpy")
def _frame(p, n, i, j):
    """Return the axes of a frame: along the line of two points, then toward their normals; and whether these tell it.

    The first normal counts twice, so that opposite ones tell a direction too.
    """
    x, y, z = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1], p[j, 2] - p[i, 2]
    u, v, w = n[i, 0] + 0.5 * n[j, 0], n[i, 1] + 0.5 * n[j, 1], n[i, 2] + 0.5 * n[j, 2]
    far = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / far if far > 0.0 else 0.0
    x, y, z = x * scale, y * scale, z * scale
    along = x * u + y * v + z * w
    u, v, w = u - along * x, v - along * y, w - along * z
    across = math.sqrt(u * u + v * v + w * w)
    told = far > 0.0 and across > TOLD
    scale = 1.0 / across if told else 0.0
    u, v, w = u * scale, v * scale, w * scale
    return ((x, y, z), (u, v, w), (y * w - z * v, z * u - x * w, x * v - y * u)), told


@njit(cache=True, error_model="numpy")
def _likeliest(p, n, q, m, rarity, shortest, slack, bend, motions):
    """Fill the motions of the pairs of correspondences that agree with most others, and are rare; return how many."""
    degree, pairs = np.zeros(len(p)), np.empty((len(p) * (len(p) - 1) // 2, 2), np.int64)
    found = agreeing(p, n, q, m, shortest, slack, bend, degree, pairs)
    weight = np.empty(found)
    for k in range(found):
        i, j = pairs[k, 0], pairs[k, 1]
        weight[k] = degree[i] * rarity[i] * degree[j] * rarity[j]
    least = -math.inf
    if found > len(motions):
        least = np.partition(weight, found - len(motions))[found - len(motions)]
    count = 0
    for k in range(found):
        i, j = pairs[k, 0], pairs[k, 1]
        if weight[k] < least or count == len(motions):
            continue
        (a, b, c), here = _frame(p, n, i, j)
        (d, e, f), there = _frame(q, m, i, j)
        if not (here and there):
            continue
        x, y, z = 0.5 * (q[i, 0] + q[j, 0]), 0.5 * (q[i, 1] + q[j, 1]), 0.5 * (q[i, 2] + q[j, 2])
        for row in range(3):
            R = (
                a[row] * d[0] + b[row] * e[0] + c[row] * f[0],
                a[row] * d[1] + b[row] * e[1] + c[row] * f[1],
                a[row] * d[2] + b[row] * e[2] + c[row] * f[2],
            )
            at = 4 * row
            motions[count, at], motions[count, at + 1], motions[count, at + 2] = R
            motions[count, at + 3] = 0.5 * (p[i, row] + p[j, row]) - (R[0] * x + R[1] * y + R[2] * z)
        count += 1
    return count


@njit(cache=True, error_model="numpy", parallel=True)
def pair_motions(p, n, rarity, asked, rows, squares, spans, q, m, starts, slacks, bend, motions, counts):
    """Fill the likeliest motions (h, 12) of each model, and how many it has.

    Points `p` of the scan with normals `n` and images `asked` are paired with the two of each model's `q` with `m`,
    from its place in `starts` on, that look likest: their images are those of its span of the `rows`. `rarity` says
    how much each point of the scan tells. `slacks` (models, 2) are the shortest distance of pairs, and by how much
    those of both may differ; `bend` by how much cosines may.
    """
    for k in prange(len(spans)):
        low, high, at = spans[k, 0], spans[k, 1], starts[k]
        counts[k] = 0
        if low == high:
            continue
        likest = np.zeros((len(p), 2), np.int64)
        two_likest(rows[low:high], squares[low:high], asked, likest)
        many = 2 * len(p)
        here, up = np.empty((many, 3)), np.empty((many, 3))
        there, away, rare = np.empty((many, 3)), np.empty((many, 3)), np.empty(many)
        for i in range(many):
            rare[i] = rarity[i // 2]
            which = at + likest[i // 2, i % 2]
            for a in range(3):
                here[i, a], up[i, a] = p[i // 2, a], n[i // 2, a]
                there[i, a], away[i, a] = q[which, a], m[which, a]
        counts[k] = _likeliest(here, up, there, away, rare, slacks[k, 0], slacks[k, 1], bend, motions[k])
