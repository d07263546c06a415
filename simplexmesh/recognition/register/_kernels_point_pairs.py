"""Features of point pairs, distance and angles of line and normals: a hash table, and votes for motions."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Array, Indices, Indices32

ANGLES, TURNS = 12, 24
"""Bins of each angle of a feature, over pi; of its length and of the rotation about a normal: finer ones collect fewer
votes."""


class Framed(NamedTuple):
    """Points (n, 3), and frames (n, 3, 3) whose rows are the unit normal and two tangents."""

    points: Array
    frames: Array


class PairTable(NamedTuple):
    """All pairs of points sorted by bin: those of bin k are ``starts[k] : starts[k + 1]`` of `firsts` and `turns`."""

    step: float  # width of a bin of lengths
    starts: Indices
    firsts: Indices32  # the first point of each pair
    turns: NDArray[np.float32]  # the angle of the second about the normal of the first


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _bin(framed, i, j, step):
    """Return the bin of the feature of points i and j, or -1."""
    p, q, n, m = framed.points[i], framed.points[j], framed.frames[i, 0], framed.frames[j, 0]
    dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    d = int(length / step)
    if d < 1 or d > TURNS:
        return -1
    a = (dx * n[0] + dy * n[1] + dz * n[2]) / length
    b = (dx * m[0] + dy * m[1] + dz * m[2]) / length
    c = n[0] * m[0] + n[1] * m[1] + n[2] * m[2]
    key = d
    for cosine in (a, b, c):
        bin_ = int(math.acos(min(1.0, max(-1.0, cosine))) * (ANGLES / math.pi))
        key = key * ANGLES + min(bin_, ANGLES - 1)
    return key


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _angle_about_normal(framed, i, j):
    """Return the angle of point j about the normal of point i, in the frame of i."""
    y = z = 0.0
    for a in range(3):
        d = framed.points[j, a] - framed.points[i, a]
        y += framed.frames[i, 1, a] * d
        z += framed.frames[i, 2, a] * d
    return math.atan2(z, y)


@njit(cache=True, error_model="numpy")
def pair_table(framed, longest):
    """Return all pairs of points about as far apart as `longest`, or nearer, sorted by bin (counting sort)."""
    n, step = len(framed.points), longest / TURNS
    starts = np.zeros((TURNS + 1) * ANGLES**3 + 2, np.int64)
    firsts, turns = np.zeros(n * n, np.int32), np.zeros(n * n, np.float32)
    for i in range(n):
        for j in range(n):
            if i != j:
                key = _bin(framed, i, j, step)
                if key >= 0:
                    starts[key + 2] += 1
    for k in range(2, len(starts)):
        starts[k] += starts[k - 1]
    for i in range(n):
        for j in range(n):
            if i != j:
                key = _bin(framed, i, j, step)
                if key >= 0:
                    slot = starts[key + 1]
                    starts[key + 1] += 1
                    firsts[slot] = i
                    turns[slot] = _angle_about_normal(framed, i, j)
    return PairTable(step, starts, firsts, turns)


@njit(cache=True, error_model="numpy")
def _vote_of(i, source, table, count):
    """Add the votes of a point i of the source to `count` (n, TURNS), of each target point and rotation."""
    for j in range(len(source.points)):
        key = _bin(source, i, j, table.step) if j != i else -1
        if key < 0 or table.starts[key + 1] - table.starts[key] > len(count):
            continue  # not distinctive, as pairs on flat sides
        turn = _angle_about_normal(source, i, j)
        for k in range(table.starts[key], table.starts[key + 1]):
            slot = (table.turns[k] - turn) * (TURNS / (2 * math.pi))
            low = math.floor(slot)
            fraction = slot - low
            low %= TURNS
            high = (low + 1) % TURNS
            count[table.firsts[k], low] += 1 - fraction
            count[table.firsts[k], high] += fraction


@njit(cache=True, error_model="numpy")
def _peaks(count, found):
    """Fill `found` (p, 2) with the rows and rotations of the largest entries of `count`, which are erased."""
    for p in range(len(found)):
        at, bin_ = divmod(count.argmax(), TURNS)
        found[p, 0], found[p, 1] = at, bin_ * (2 * math.pi / TURNS)
        for b in range(-1, 2):
            count[at, (bin_ + b) % TURNS] = -1


@by_rows(2)
def vote(begin, end, references, source, table, n_target, found):
    """Fill `found` (r, p, 2): target points and rotations about the normal, radians, with most votes per reference."""
    for r in range(begin, end):
        count = np.zeros((n_target, TURNS), np.float32)
        _vote_of(references[r], source, table, count)
        _peaks(count, found[r])
