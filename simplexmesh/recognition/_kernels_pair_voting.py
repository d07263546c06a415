"""Point pair features: a hash table, and votes for motions. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit

FLAGS = {"nsz", "arcp", "contract", "reassoc"}
ANGLES = 12
"""Bins of each of the three angles of a pair feature, over pi."""

TURNS = 24
"""Bins of the rotation about a normal."""


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def _key(points, normals, i, j, step, distances):
    """Return the bin of a point pair feature (distance, angles of its line and normals, angle of these), or -1."""
    dx, dy, dz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    d = int(length / step)
    if d < 1 or d >= distances:
        return -1
    a = (dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]) / length
    b = (dx * normals[j, 0] + dy * normals[j, 1] + dz * normals[j, 2]) / length
    c = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
    key = d
    for cosine in (a, b, c):
        bin_ = int(math.acos(min(1.0, max(-1.0, cosine))) * (ANGLES / math.pi))
        key = key * ANGLES + min(bin_, ANGLES - 1)
    return key


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def _angle_about_normal(points, frames, i, j):
    """Return the angle of point j about the normal of point i, in the frame of i."""
    y = z = 0.0
    for a in range(3):
        d = points[j, a] - points[i, a]
        y += frames[i, 1, a] * d
        z += frames[i, 2, a] * d
    return math.atan2(z, y)


@njit(cache=True, error_model="numpy")
def pair_table(points, normals, frames, step, distances, starts, firsts, turns):
    """Sort all pairs by bin (counting sort): bin k is ``starts[k] : starts[k + 1]`` of `firsts` and `turns`."""
    n = len(points)
    for i in range(n):
        for j in range(n):
            if i != j:
                key = _key(points, normals, i, j, step, distances)
                if key >= 0:
                    starts[key + 2] += 1
    for k in range(2, len(starts)):
        starts[k] += starts[k - 1]
    for i in range(n):
        for j in range(n):
            if i != j:
                key = _key(points, normals, i, j, step, distances)
                if key >= 0:
                    slot = starts[key + 1]
                    starts[key + 1] += 1
                    firsts[slot] = i
                    turns[slot] = _angle_about_normal(points, frames, i, j)


@njit(cache=True, error_model="numpy", parallel=True)
def vote(references, points, normals, frames, step, distances, starts, firsts, turns, n_target, found, votes, maximum):
    """Find the p target points and rotations about the normal with the most votes, for each of r reference points.

    `found` (r, p, 2) gets the target point and the angle in radians, `votes` (r, p) the votes. Bins with more than
    `maximum` pairs are not distinctive and are skipped.
    """
    for r in prange(len(references)):
        i = references[r]
        count = np.zeros((n_target, TURNS), np.float32)
        for j in range(len(points)):
            if i == j:
                continue
            key = _key(points, normals, i, j, step, distances)
            if key < 0 or starts[key + 1] - starts[key] > maximum:
                continue
            turn = _angle_about_normal(points, frames, i, j)
            for k in range(starts[key], starts[key + 1]):
                slot = (turns[k] - turn) * (TURNS / (2 * math.pi))
                low = math.floor(slot)
                fraction = slot - low
                low %= TURNS
                high = (low + 1) % TURNS
                count[firsts[k], low] += 1 - fraction
                count[firsts[k], high] += fraction
        for p in range(found.shape[1]):
            best, at, bin_ = np.float32(-1.0), 0, 0
            for t in range(n_target):
                for b in range(TURNS):
                    if count[t, b] > best:
                        best, at, bin_ = count[t, b], t, b
            found[r, p, 0] = at
            found[r, p, 1] = bin_ * (2 * math.pi / TURNS)
            votes[r, p] = best
            for b in range(-1, 2):
                count[at, (bin_ + b) % TURNS] = -1
