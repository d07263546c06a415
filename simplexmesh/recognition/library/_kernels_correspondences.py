"""Candidate motions of many models from consistent correspondences of oriented points: rows of point and normal."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh._base.arrays import Indices
from simplexmesh.recognition.library._kernels_descriptors import two_nearest

MINIMUM_ACROSS = 0.1
"""Least component of a pair's normals across its line for which they determine a frame."""


class Tolerances(NamedTuple):
    """What a rigid motion may do to a pair of oriented points."""

    minimum_length: float  # of the pair in the scan; half of it in the model
    length: float  # by which the lengths may differ
    cosine: float  # by which the cosines of the line with the normals, and of the normals, may differ


class Likeness(NamedTuple):
    """Descriptors of the scan (k, d) and of all models (n, d), and the range (m, 2) of each model's rows."""

    queries: NDArray[np.float32]
    rows: NDArray[np.float32]
    squares: NDArray[np.float32]  # (n,) squared norms of the rows
    spans: Indices


@njit(cache=True, error_model="numpy", fastmath=FAST)
def _mark_consistent(i, scan, model, tolerances, out):
    """Fill `out[j]`, for j < i, with whether i and j of oriented points, columns (6, k), are consistent; vectorized."""
    p, n, q, m = scan[:3], scan[3:], model[:3], model[3:]
    minimum_length, tolerance, cosine_tolerance = tolerances
    a, b, c, d, e, f = p[0, i], p[1, i], p[2, i], q[0, i], q[1, i], q[2, i]
    g, h, k, r, s, t = n[0, i], n[1, i], n[2, i], m[0, i], m[1, i], m[2, i]
    for j in range(i):
        x, y, z, u, v, w = p[0, j] - a, p[1, j] - b, p[2, j] - c, q[0, j] - d, q[1, j] - e, q[2, j] - f
        here, there = math.sqrt(x * x + y * y + z * z), math.sqrt(u * u + v * v + w * w)
        far = (here >= minimum_length) & (there >= 0.5 * minimum_length) & (abs(here - there) <= tolerance)
        l, o = 1.0 / here, 1.0 / there  # noqa: E741
        one = (x * g + y * h + z * k) * l - (u * r + v * s + w * t) * o
        other = (x * n[0, j] + y * n[1, j] + z * n[2, j]) * l - (u * m[0, j] + v * m[1, j] + w * m[2, j]) * o
        both = g * n[0, j] + h * n[1, j] + k * n[2, j] - r * m[0, j] - s * m[1, j] - t * m[2, j]
        out[j] = (
            far & (abs(one) <= cosine_tolerance) & (abs(other) <= cosine_tolerance) & (abs(both) <= cosine_tolerance)
        )


@njit(cache=True, error_model="numpy", fastmath=FAST)
def consistent_pairs(scan, model, tolerances, degree, pairs):
    """Fill the pairs of oriented points (k, 6) that a rigid motion explains, and each one's; return how many."""
    count = 0
    degree[:] = 0
    scan_columns, model_columns = scan.T.copy(), model.T.copy()
    agree = np.zeros(len(scan), np.uint8)
    for i in range(len(scan)):
        _mark_consistent(i, scan_columns, model_columns, tolerances, agree)
        for j in range(i):
            if agree[j]:
                degree[i] += 1
                degree[j] += 1
                pairs[count, 0], pairs[count, 1] = i, j
                count += 1
    return count


@njit(cache=True, error_model="numpy")
def _frame(oriented, i, j):
    """Return the frame of a pair, axes along its line and toward its normals, and whether it is determined."""
    p, q = oriented[i], oriented[j]
    x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    # the first normal has twice the weight, so that opposite normals determine a frame too
    u, v, w = p[3] + 0.5 * q[3], p[4] + 0.5 * q[4], p[5] + 0.5 * q[5]
    far = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / far if far > 0.0 else 0.0
    x, y, z = x * scale, y * scale, z * scale
    along = x * u + y * v + z * w
    u, v, w = u - along * x, v - along * y, w - along * z
    across = math.sqrt(u * u + v * v + w * w)
    determined = far > 0.0 and across > MINIMUM_ACROSS
    scale = 1.0 / across if determined else 0.0
    u, v, w = u * scale, v * scale, w * scale
    return ((x, y, z), (u, v, w), (y * w - z * v, z * u - x * w, x * v - y * u)), determined


@njit(cache=True, error_model="numpy")
def _best_pair_motions(scan, model, distinctiveness, tolerances, motions):
    """Fill the motions of the consistent pairs with the highest degree and distinctiveness; return their number."""
    degree, pairs = np.zeros(len(scan)), np.empty((len(scan) * (len(scan) - 1) // 2, 2), np.int64)
    found = consistent_pairs(scan, model, tolerances, degree, pairs)
    weight = np.empty(found)
    for k in range(found):
        i, j = pairs[k, 0], pairs[k, 1]
        weight[k] = degree[i] * distinctiveness[i] * degree[j] * distinctiveness[j]
    least = -math.inf
    if found > len(motions):
        least = np.partition(weight, found - len(motions))[found - len(motions)]
    count = 0
    for k in range(found):
        i, j = pairs[k, 0], pairs[k, 1]
        if weight[k] < least or count == len(motions):
            continue
        (a, b, c), scan_determined = _frame(scan, i, j)
        (d, e, f), model_determined = _frame(model, i, j)
        if not (scan_determined and model_determined):
            continue
        x, y, z = (
            0.5 * (model[i, 0] + model[j, 0]),
            0.5 * (model[i, 1] + model[j, 1]),
            0.5 * (model[i, 2] + model[j, 2]),
        )
        for row in range(3):
            R = (
                a[row] * d[0] + b[row] * e[0] + c[row] * f[0],
                a[row] * d[1] + b[row] * e[1] + c[row] * f[1],
                a[row] * d[2] + b[row] * e[2] + c[row] * f[2],
            )
            at = 4 * row
            motions[count, at], motions[count, at + 1], motions[count, at + 2] = R
            motions[count, at + 3] = 0.5 * (scan[i, row] + scan[j, row]) - (R[0] * x + R[1] * y + R[2] * z)
        count += 1
    return count


@by_rows(2)
def pair_motions(begin, end, scan, distinctiveness, models, starts, likeness, tolerances, motions, counts):
    """Fill the best motions (h, 12) of each model, and their number, from the two rows most like each scan point."""
    for k in range(begin, end):
        low, high, at = likeness.spans[k, 0], likeness.spans[k, 1], starts[k]
        counts[k] = 0
        if low == high:
            continue
        nearest = np.zeros((len(scan), 2), np.int64)
        two_nearest(likeness.rows[low:high], likeness.squares[low:high], likeness.queries, nearest)
        count = 2 * len(scan)
        scan_points, model_points, weights = np.empty((count, 6)), np.empty((count, 6)), np.empty(count)
        for i in range(count):
            weights[i] = distinctiveness[i // 2]
            row = at + nearest[i // 2, i % 2]
            for a in range(6):
                scan_points[i, a], model_points[i, a] = scan[i // 2, a], models[row, a]
        limits = (tolerances[k, 0], tolerances[k, 1], tolerances[k, 2])
        counts[k] = _best_pair_motions(scan_points, model_points, weights, limits, motions[k])
