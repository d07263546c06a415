"""Pairs of points that look alike vote for motions; motions are followed and judged on a grid of nearest points.

Arrays in, arrays out; no checks. Motions are rows of 12 numbers: a rotation by rows, each with its shift.
"""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit

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


@njit(cache=True, error_model="numpy")
def _cell(grid, low, scale, x, y, z):
    """Return which point of the target is about nearest, -1 outside of the grid; `scale` is one over its cells' side.

    Unsigned places need one comparison each, and numba does not ask whether they count from the end.
    """
    i = np.uint64(np.int64(math.floor((x - low[0]) * scale)))
    j = np.uint64(np.int64(math.floor((y - low[1]) * scale)))
    k = np.uint64(np.int64(math.floor((z - low[2]) * scale)))
    if i >= np.uint64(grid.shape[0]) or j >= np.uint64(grid.shape[1]) or k >= np.uint64(grid.shape[2]):
        return np.int64(-1)
    return np.int64(grid[i, j, k])


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def judged(m, samples, first, last, grid, low, scale, target, width, reach):
    """Return the score of one motion on the samples from one to another; see `judge`.

    Nothing is passed over, so that the compiler takes several samples at a time.
    """
    a, b, c, d, e, f = m[0], m[1], m[2], m[3], m[4], m[5]
    g, h, i, j, k, n = m[6], m[7], m[8], m[9], m[10], m[11]
    px, py, pz = samples[0, first:last], samples[1, first:last], samples[2, first:last]
    nx, ny, nz = samples[3, first:last], samples[4, first:last], samples[5, first:last]
    cells, (sx, sy, sz), planes, lx, ly, lz = grid.ravel(), grid.shape, target.ravel(), low[0], low[1], low[2]
    trust, farthest, total = 1.0 / (width * width), reach * reach, 0.0
    for s in range(len(px)):
        x, y = a * px[s] + b * py[s] + c * pz[s] + d, e * px[s] + f * py[s] + g * pz[s] + h
        z = i * px[s] + j * py[s] + k * pz[s] + n
        u, v, w = (x - lx) * scale, (y - ly) * scale, (z - lz) * scale
        inside = (u >= 0) & (v >= 0) & (w >= 0) & (u < sx) & (v < sy) & (w < sz)
        u, v, w = min(max(u, 0.0), sx - 1.0), min(max(v, 0.0), sy - 1.0), min(max(w, 0.0), sz - 1.0)
        t = 6 * np.int64(cells[(np.int64(u) * sy + np.int64(v)) * sz + np.int64(w)])
        x, y, z = x - planes[t], y - planes[t + 1], z - planes[t + 2]
        p, q, r = planes[t + 3], planes[t + 4], planes[t + 5]
        lack = x * p + y * q + z * r
        alike = (
            (a * nx[s] + b * ny[s] + c * nz[s]) * p
            + (e * nx[s] + f * ny[s] + g * nz[s]) * q
            + (i * nx[s] + j * ny[s] + k * nz[s]) * r
        )
        mark = max(-1.0, 1 - lack * lack * trust) * max(alike, 0.0)
        total += mark if inside & (x * x + y * y + z * z <= farthest) else 0.0
    return total / len(px)


@njit(cache=True, error_model="numpy", parallel=True)
def judge(motions, samples, grid, low, cell, target, width, reach, scores):
    """Score motions: the mean over samples of how near they come to the target's planes, and how alike normals are.

    Columns of `samples` (6, k), and rows of `target` (n, 6), are points and normals. Points that come near the target
    but off its planes speak against a motion; those far from it do not.
    """
    for h in prange(len(motions)):
        scores[h] = judged(motions[h], samples, 0, samples.shape[1], grid, low, 1.0 / cell, target, width, reach)


@njit(cache=True, error_model="numpy")
def differing(motions, limit, far, kept):
    """Fill `kept` with which motions, in order, differ from all kept before, until it is full; return how many.

    Those are one whose rotations have a product of a trace above `limit` and whose shifts are nearer than `far`.
    """
    count = 0
    for k in range(len(motions)):
        if count == len(kept):
            break
        new = True
        for i in range(count):
            one, other = motions[kept[i]], motions[k]
            trace = apart = 0.0
            for a in range(0, 12, 4):
                trace += one[a] * other[a] + one[a + 1] * other[a + 1] + one[a + 2] * other[a + 2]
                apart += (one[a + 3] - other[a + 3]) ** 2
            if trace > limit and math.sqrt(apart) < far:
                new = False
                break
        if new:
            kept[count] = k
            count += 1
    return count


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


@njit(cache=True, error_model="numpy")
def _pulled(m, samples, first, last, grid, low, scale, target, width, A, b):
    """Fill the normal equations (6, 6) and (6,) of the small motion that brings samples to planes; return the weights.

    Only the lower half of the matrix.
    """
    A[:] = 0.0
    b[:] = 0.0
    weights, narrow = 0.0, 1.0 / (width * width)
    for s in range(first, last):
        px, py, pz = samples[0, s], samples[1, s], samples[2, s]
        x = m[0] * px + m[1] * py + m[2] * pz + m[3]
        y = m[4] * px + m[5] * py + m[6] * pz + m[7]
        z = m[8] * px + m[9] * py + m[10] * pz + m[11]
        near = _cell(grid, low, scale, x, y, z)
        if near < 0:
            continue
        t = np.uint64(near)
        nx, ny, nz = target[t, 3], target[t, 4], target[t, 5]
        dx, dy, dz = x - target[t, 0], y - target[t, 1], z - target[t, 2]
        far = (dx * dx + dy * dy + dz * dz) * narrow
        px, py, pz = samples[3, s], samples[4, s], samples[5, s]
        alike = (
            (m[0] * px + m[1] * py + m[2] * pz) * nx
            + (m[4] * px + m[5] * py + m[6] * pz) * ny
            + (m[8] * px + m[9] * py + m[10] * pz) * nz
        )
        if far > 4.0 or alike < 0.2:
            continue
        weight = alike / (1 + far) ** 2
        row = (y * nz - z * ny, z * nx - x * nz, x * ny - y * nx, nx, ny, nz)
        lack = weight * (dx * nx + dy * ny + dz * nz)
        weights += weight
        for i in range(6):
            b[i] -= lack * row[i]
            for j in range(i + 1):
                A[i, j] += weight * row[i] * row[j]
    return weights


@njit(cache=True, error_model="numpy")
def followed(m, samples, first, last, grid, low, scale, target, widths, A, b, x):
    """Move one motion, in place; see `follow`. `A`, `b` and `x` are room for six equations."""
    for width in widths:
        weights = _pulled(m, samples, first, last, grid, low, scale, target, width, A, b)
        for i in range(6):
            A[i, i] += 1e-3 * weights * (0.05 if i < 3 else 1.0) + 1e-9
        _solved(A, b, x)
        _moved(m, x)


@njit(cache=True, error_model="numpy", parallel=True)
def follow(motions, samples, grid, low, cell, target, widths):
    """Move motions, in place, so that samples come to the target's planes; one step for each width of the weights."""
    for h in prange(len(motions)):
        A, b, x = np.zeros((6, 6)), np.zeros(6), np.zeros(6)
        followed(motions[h], samples, 0, samples.shape[1], grid, low, 1.0 / cell, target, widths, A, b, x)
