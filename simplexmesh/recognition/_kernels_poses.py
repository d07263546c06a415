"""Motions of many models at once, from pairs of points that look alike. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

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
def _frame(p, n, q, m, frame):
    """Fill the columns of a frame: along the line of two points, then toward their normals; whether these tell it.

    The first normal counts twice, so that opposite ones tell a direction too.
    """
    length = along = 0.0
    for a in range(3):
        frame[a, 0] = q[a] - p[a]
        length += frame[a, 0] ** 2
    length = math.sqrt(length)
    if not length > 0.0:
        return False
    for a in range(3):
        frame[a, 0] /= length
        frame[a, 1] = n[a] + 0.5 * m[a]
        along += frame[a, 0] * frame[a, 1]
    length = 0.0
    for a in range(3):
        frame[a, 1] -= along * frame[a, 0]
        length += frame[a, 1] ** 2
    length = math.sqrt(length)
    if not length > TOLD:
        return False
    for a in range(3):
        frame[a, 1] /= length
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        frame[a, 2] = frame[b, 0] * frame[c, 1] - frame[c, 0] * frame[b, 1]
    return True


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
    here, there = np.zeros((3, 3)), np.zeros((3, 3))
    count = 0
    for k in range(found):
        i, j = pairs[k, 0], pairs[k, 1]
        if weight[k] < least or count == len(motions):
            continue
        if not (_frame(p[i], n[i], p[j], n[j], here) and _frame(q[i], m[i], q[j], m[j], there)):
            continue
        for a in range(3):
            shift = 0.5 * (p[i, a] + p[j, a])
            for b in range(3):
                R = here[a, 0] * there[b, 0] + here[a, 1] * there[b, 1] + here[a, 2] * there[b, 2]
                motions[count, 4 * a + b] = R
                shift -= R * 0.5 * (q[i, b] + q[j, b])
            motions[count, 4 * a + 3] = shift
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
