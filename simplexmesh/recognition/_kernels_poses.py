"""Candidate motions of many models from consistent correspondences. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.recognition._kernels_descriptors import two_nearest

FLAGS = {"nsz", "arcp", "contract", "reassoc"}
MINIMUM_ACROSS = 0.1
"""Least component of a pair's normals across its line for which they determine a frame."""


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def _consistent(i, p, n, q, m, minimum_length, tolerance, cosine_tolerance, out):
    """Fill `out[j]`, for j < i, with whether correspondences i and j are consistent; arrays are columns (3, k).

    Without branches, so that the loop is vectorized.
    """
    a, b, c, d, e, f = p[0, i], p[1, i], p[2, i], q[0, i], q[1, i], q[2, i]
    g, h, k, r, s, t = n[0, i], n[1, i], n[2, i], m[0, i], m[1, i], m[2, i]
    for j in range(i):
        x, y, z, u, v, w = p[0, j] - a, p[1, j] - b, p[2, j] - c, q[0, j] - d, q[1, j] - e, q[2, j] - f
        scan, model = math.sqrt(x * x + y * y + z * z), math.sqrt(u * u + v * v + w * w)
        far = (scan >= minimum_length) & (model >= 0.5 * minimum_length) & (abs(scan - model) <= tolerance)
        l, o = 1.0 / scan, 1.0 / model  # noqa: E741
        one = (x * g + y * h + z * k) * l - (u * r + v * s + w * t) * o
        other = (x * n[0, j] + y * n[1, j] + z * n[2, j]) * l - (u * m[0, j] + v * m[1, j] + w * m[2, j]) * o
        both = g * n[0, j] + h * n[1, j] + k * n[2, j] - r * m[0, j] - s * m[1, j] - t * m[2, j]
        out[j] = (
            far & (abs(one) <= cosine_tolerance) & (abs(other) <= cosine_tolerance) & (abs(both) <= cosine_tolerance)
        )


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def consistent_pairs(p, n, q, m, minimum_length, tolerance, cosine_tolerance, degree, pairs):
    """Find the pairs of correspondences (p, n) to (q, m) of oriented points that a rigid motion can explain.

    Their distances exceed `minimum_length` and differ by at most `tolerance`; the cosines of their line with the
    normals, and between the normals, differ by at most `cosine_tolerance`. `degree` gets the number of consistent
    partners of each; `pairs` must have room for all pairs. Return the number of pairs.
    """
    count = 0
    degree[:] = 0
    columns = p.T.copy(), n.T.copy(), q.T.copy(), m.T.copy()
    agree = np.zeros(len(p), np.uint8)
    for i in range(len(p)):
        _consistent(
            i, columns[0], columns[1], columns[2], columns[3], minimum_length, tolerance, cosine_tolerance, agree
        )
        for j in range(i):
            if agree[j]:
                degree[i] += 1
                degree[j] += 1
                pairs[count, 0], pairs[count, 1] = i, j
                count += 1
    return count


@njit(cache=True, error_model="numpy")
def dequantize(levels, directions, scale, low, points, normals):
    """Fill points, `levels` times a scale plus a corner, and unit normals along `directions`."""
    for i in range(len(levels)):
        square = 0.0
        for a in range(3):
            points[i, a] = levels[i, a] * scale + low[a]
            square += float(directions[i, a]) ** 2
        length = math.sqrt(square)
        for a in range(3):
            normals[i, a] = directions[i, a] / length if length > 0 else 0.0


@njit(cache=True, error_model="numpy")
def _frame(p, n, i, j):
    """Return the frame of an oriented pair, axes along its line and toward its normals, and whether it is determined.

    The first normal has twice the weight, so that opposite normals determine a frame too.
    """
    x, y, z = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1], p[j, 2] - p[i, 2]
    u, v, w = n[i, 0] + 0.5 * n[j, 0], n[i, 1] + 0.5 * n[j, 1], n[i, 2] + 0.5 * n[j, 2]
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
def _best_pair_motions(p, n, q, m, distinctiveness, minimum_length, tolerance, cosine_tolerance, motions):
    """Fill the motions of the consistent pairs with the highest degree and distinctiveness; return their number."""
    degree, pairs = np.zeros(len(p)), np.empty((len(p) * (len(p) - 1) // 2, 2), np.int64)
    found = consistent_pairs(p, n, q, m, minimum_length, tolerance, cosine_tolerance, degree, pairs)
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
        (a, b, c), scan_determined = _frame(p, n, i, j)
        (d, e, f), model_determined = _frame(q, m, i, j)
        if not (scan_determined and model_determined):
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
def pair_motions(
    p, n, distinctiveness, queries, rows, squares, spans, q, m, starts, tolerances, cosine_tolerance, motions, counts
):
    """Fill the best motions (h, 12) of each model, and their number.

    Scan points `p` with normals `n` and descriptors `queries` correspond to the two model points, of `q` with normals
    `m` from ``starts`` on, with the nearest descriptors, which are the range ``spans`` of `rows`. `distinctiveness`
    weights the scan points. `tolerances` (models, 2) are the minimum length of pairs and the tolerance of their length.
    """
    for k in prange(len(spans)):
        low, high, at = spans[k, 0], spans[k, 1], starts[k]
        counts[k] = 0
        if low == high:
            continue
        nearest = np.zeros((len(p), 2), np.int64)
        two_nearest(rows[low:high], squares[low:high], queries, nearest)
        count = 2 * len(p)
        scan_points, scan_normals = np.empty((count, 3)), np.empty((count, 3))
        model_points, model_normals, weights = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
        for i in range(count):
            weights[i] = distinctiveness[i // 2]
            row = at + nearest[i // 2, i % 2]
            for a in range(3):
                scan_points[i, a], scan_normals[i, a] = p[i // 2, a], n[i // 2, a]
                model_points[i, a], model_normals[i, a] = q[row, a], m[row, a]
        counts[k] = _best_pair_motions(
            scan_points, scan_normals, model_points, model_normals, weights, tolerances[k, 0], tolerances[k, 1],
            cosine_tolerance, motions[k],
        )  # fmt: skip
