"""Pairs of points that look alike vote for motions; motions are followed and judged on a grid of nearest points.

Arrays in, arrays out; no checks. Motions are rows of 12 numbers: a rotation by rows, each with its shift.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

FLAGS = {"nsz", "arcp", "contract", "reassoc"}
ANGLES = 12
"""Bins of each of the three angles of a pair, over half a turn."""

TURNS = 24
"""Bins of the turn about a normal."""


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def _key(points, normals, i, j, step, distances):
    """Return the bin of a pair: its distance, the angles of its line with both normals, and that between these."""
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
def _turn(points, frames, i, j):
    """Return the angle of a pair's second point about the normal of the first."""
    y = z = 0.0
    for a in range(3):
        d = points[j, a] - points[i, a]
        y += frames[i, 1, a] * d
        z += frames[i, 2, a] * d
    return math.atan2(z, y)


@njit(cache=True, error_model="numpy")
def pair_table(points, normals, frames, step, distances, starts, firsts, turns):
    """Sort all pairs by their bins: those of bin k are at ``starts[k] : starts[k + 1]`` of `firsts` and `turns`."""
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
                    place = starts[key + 1]
                    starts[key + 1] += 1
                    firsts[place] = i
                    turns[place] = _turn(points, frames, i, j)


@njit(cache=True, error_model="numpy", parallel=True)
def vote(references, points, normals, frames, step, distances, starts, firsts, turns, n_target, found, votes, most):
    """Find, for each reference point, the points of the target and turns that most of its pairs speak for.

    `found` (r, p, 2) becomes the target's point and the turn in radians, `votes` (r, p) how many pairs; bins with
    more than `most` pairs say little and are passed over.
    """
    for r in prange(len(references)):
        i = references[r]
        count = np.zeros((n_target, TURNS), np.float32)
        for j in range(len(points)):
            if i == j:
                continue
            key = _key(points, normals, i, j, step, distances)
            if key < 0 or starts[key + 1] - starts[key] > most:
                continue
            turn = _turn(points, frames, i, j)
            for k in range(starts[key], starts[key + 1]):
                place = (turns[k] - turn) * (TURNS / (2 * math.pi))
                low = math.floor(place)
                share = place - low
                low %= TURNS
                high = (low + 1) % TURNS
                count[firsts[k], low] += 1 - share
                count[firsts[k], high] += share
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


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def _cell(grid, low, cell, x, y, z):
    """Return which point of the target is about nearest, -1 outside of the grid."""
    i, j, k = int((x - low[0]) / cell), int((y - low[1]) / cell), int((z - low[2]) / cell)
    if x < low[0] or y < low[1] or z < low[2] or i >= grid.shape[0] or j >= grid.shape[1] or k >= grid.shape[2]:
        return -1
    return grid[i, j, k]


@njit(cache=True, error_model="numpy", parallel=True)
def judge(motions, points, normals, grid, low, cell, target, target_normals, width, reach, scores):
    """Score motions: the mean over points of how near they come to the target's planes, and how alike normals are.

    Points that come near the target but off its planes speak against a motion; those far from it do not.
    """
    for h in prange(len(motions)):
        m = motions[h]
        total = 0.0
        for s in range(len(points)):
            px, py, pz = points[s, 0], points[s, 1], points[s, 2]
            x = m[0] * px + m[1] * py + m[2] * pz + m[3]
            y = m[4] * px + m[5] * py + m[6] * pz + m[7]
            z = m[8] * px + m[9] * py + m[10] * pz + m[11]
            t = _cell(grid, low, cell, x, y, z)
            if t < 0:
                continue
            dx, dy, dz = x - target[t, 0], y - target[t, 1], z - target[t, 2]
            lack = dx * target_normals[t, 0] + dy * target_normals[t, 1] + dz * target_normals[t, 2]
            far = dx * dx + dy * dy + dz * dz
            if far > reach * reach:
                continue
            px, py, pz = normals[s, 0], normals[s, 1], normals[s, 2]
            alike = (
                (m[0] * px + m[1] * py + m[2] * pz) * target_normals[t, 0]
                + (m[4] * px + m[5] * py + m[6] * pz) * target_normals[t, 1]
                + (m[8] * px + m[9] * py + m[10] * pz) * target_normals[t, 2]
            )
            if alike > 0:
                total += max(-1.0, 1 - (lack / width) ** 2) * alike
        scores[h] = total / len(points)


@njit(cache=True, error_model="numpy")
def _solved(A, b, x):
    """Solve a positive 6 x 6 system by Cholesky's factors, in place; a hopeless one gives zero."""
    for i in range(6):
        for j in range(i + 1):
            value = A[i, j]
            for k in range(j):
                value -= A[i, k] * A[j, k]
            if i == j:
                if value <= 1e-12:
                    x[:] = 0.0
                    return
                A[i, i] = math.sqrt(value)
            else:
                A[i, j] = value / A[j, j]
    for i in range(6):
        value = b[i]
        for k in range(i):
            value -= A[i, k] * x[k]
        x[i] = value / A[i, i]
    for i in range(5, -1, -1):
        value = x[i]
        for k in range(i + 1, 6):
            value -= A[k, i] * x[k]
        x[i] = value / A[i, i]


@njit(cache=True, error_model="numpy")
def _moved(m, x):
    """Turn and shift a motion, in place, by the small motion x: a rotation vector, then a shift."""
    angle = math.sqrt(x[0] ** 2 + x[1] ** 2 + x[2] ** 2)
    s = math.sin(angle) / angle if angle > 1e-12 else 1.0
    c = (1 - math.cos(angle)) / (angle * angle) if angle > 1e-12 else 0.5
    u, v, w = x[0], x[1], x[2]
    R = np.array([
        [1 - c * (v * v + w * w), c * u * v - s * w, c * u * w + s * v],
        [c * u * v + s * w, 1 - c * (u * u + w * w), c * v * w - s * u],
        [c * u * w - s * v, c * v * w + s * u, 1 - c * (u * u + v * v)],
    ])  # fmt: skip
    for column in range(4):
        p, q, r = m[column], m[4 + column], m[8 + column]
        for row in range(3):
            m[4 * row + column] = R[row, 0] * p + R[row, 1] * q + R[row, 2] * r
    for row in range(3):
        m[4 * row + 3] += x[3 + row]


@njit(cache=True, error_model="numpy", parallel=True)
def follow(motions, points, normals, grid, low, cell, target, target_normals, widths):
    """Move motions, in place, so that points come to the target's planes; one step for each width of the weights."""
    for h in prange(len(motions)):
        m = motions[h]
        A, b, x, row = np.zeros((6, 6)), np.zeros(6), np.zeros(6), np.zeros(6)
        for width in widths:
            A[:] = 0.0
            b[:] = 0.0
            weights = 0.0
            for s in range(len(points)):
                px, py, pz = points[s, 0], points[s, 1], points[s, 2]
                qx = m[0] * px + m[1] * py + m[2] * pz + m[3]
                qy = m[4] * px + m[5] * py + m[6] * pz + m[7]
                qz = m[8] * px + m[9] * py + m[10] * pz + m[11]
                t = _cell(grid, low, cell, qx, qy, qz)
                if t < 0:
                    continue
                nx, ny, nz = target_normals[t, 0], target_normals[t, 1], target_normals[t, 2]
                dx, dy, dz = qx - target[t, 0], qy - target[t, 1], qz - target[t, 2]
                far = (dx * dx + dy * dy + dz * dz) / (width * width)
                px, py, pz = normals[s, 0], normals[s, 1], normals[s, 2]
                alike = (
                    (m[0] * px + m[1] * py + m[2] * pz) * nx
                    + (m[4] * px + m[5] * py + m[6] * pz) * ny
                    + (m[8] * px + m[9] * py + m[10] * pz) * nz
                )
                if far > 4.0 or alike < 0.2:
                    continue
                weight = alike / (1 + far) ** 2
                lack = dx * nx + dy * ny + dz * nz
                row[0], row[1], row[2] = qy * nz - qz * ny, qz * nx - qx * nz, qx * ny - qy * nx
                row[3], row[4], row[5] = nx, ny, nz
                weights += weight
                for i in range(6):
                    b[i] -= weight * lack * row[i]
                    for j in range(i + 1):
                        A[i, j] += weight * row[i] * row[j]
            for i in range(6):
                A[i, i] += 1e-3 * weights * (0.05 if i < 3 else 1.0) + 1e-9
            _solved(A, b, x)
            _moved(m, x)
