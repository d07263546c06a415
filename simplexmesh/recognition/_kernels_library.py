"""What tells one shape from another without a pose: images about points, distances; and pairs that agree on a pose."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit

FLAGS = {"nsz", "arcp", "contract", "reassoc"}
AWAY, ALONG = 5, 8
"""Bins of a spin image: distances from the normal, heights along it."""

LENGTHS, BENDS, REACHES = 22, 4, 22
"""Bins of a profile: lengths of pairs by how their normals bend, and distances from the middle."""


@njit(cache=True, error_model="numpy", parallel=True, fastmath=FLAGS)
def spin_images(points, normals, chosen, radius, images):
    """Fill, for each chosen point, where the points within a radius lie: how far from its normal, how high along it.

    Each point is shared between the nearest bins; points near the radius count less.
    """
    for k in prange(len(chosen)):
        i = chosen[k]
        for j in range(len(points)):
            dx, dy, dz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            square = (dx * dx + dy * dy + dz * dz) / (radius * radius)
            if square > 1.0:
                continue
            height = (dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]) / radius
            away = math.sqrt(max(square - height * height, 0.0))
            weight = 1.0 - square * square
            x, y = away * AWAY - 0.5, (height + 1.0) * 0.5 * ALONG - 0.5
            left, low = math.floor(x), math.floor(y)
            for a in range(2):
                for b in range(2):
                    share = (x - left if a else 1.0 - x + left) * (y - low if b else 1.0 - y + low)
                    column, row = min(max(left + a, 0), AWAY - 1), min(max(low + b, 0), ALONG - 1)
                    images[k, column * ALONG + row] += weight * share


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def pair_profile(points, normals, longest, pairs):
    """Count pairs of points by their distance and the cosine between their normals, into `pairs` (LENGTHS, BENDS).

    Distances from `longest` on go into the last bin.
    """
    for i in range(len(points)):
        for j in range(i):
            dx, dy, dz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            bend = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            a = min(int(length / longest * LENGTHS), LENGTHS - 1)
            b = min(max(int((bend + 1.0) * 0.5 * BENDS), 0), BENDS - 1)
            pairs[a, b] += 1.0


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def _agree_with(i, p, n, q, m, shortest, slack, bend, out):
    """Fill `out[j]`, for j < i, with whether correspondences i and j agree; points and normals are columns (3, k).

    Nothing is passed over, so that the compiler takes several j at a time.
    """
    a, b, c, d, e, f = p[0, i], p[1, i], p[2, i], q[0, i], q[1, i], q[2, i]
    g, h, k, r, s, t = n[0, i], n[1, i], n[2, i], m[0, i], m[1, i], m[2, i]
    for j in range(i):
        x, y, z, u, v, w = p[0, j] - a, p[1, j] - b, p[2, j] - c, q[0, j] - d, q[1, j] - e, q[2, j] - f
        here, there = math.sqrt(x * x + y * y + z * z), math.sqrt(u * u + v * v + w * w)
        far = (here >= shortest) & (there >= 0.5 * shortest) & (abs(here - there) <= slack)
        l, o = 1.0 / here, 1.0 / there  # noqa: E741
        one = (x * g + y * h + z * k) * l - (u * r + v * s + w * t) * o
        other = (x * n[0, j] + y * n[1, j] + z * n[2, j]) * l - (u * m[0, j] + v * m[1, j] + w * m[2, j]) * o
        both = g * n[0, j] + h * n[1, j] + k * n[2, j] - r * m[0, j] - s * m[1, j] - t * m[2, j]
        out[j] = far & (abs(one) <= bend) & (abs(other) <= bend) & (abs(both) <= bend)


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def agreeing(p, n, q, m, shortest, slack, bend, degree, pairs):
    """Find which two correspondences (p, n) to (q, m) of points with normals one motion may bring about.

    Their distances differ by no more than `slack` and are longer than `shortest`, and the three cosines between their
    line and the normals differ by no more than `bend`. `degree` becomes how many agree with each; the pairs go into
    `pairs`, which has room for all. Return how many they are.
    """
    count = 0
    degree[:] = 0
    columns = p.T.copy(), n.T.copy(), q.T.copy(), m.T.copy()
    agree = np.zeros(len(p), np.uint8)
    for i in range(len(p)):
        _agree_with(i, columns[0], columns[1], columns[2], columns[3], shortest, slack, bend, agree)
        for j in range(i):
            if agree[j]:
                degree[i] += 1
                degree[j] += 1
                pairs[count, 0], pairs[count, 1] = i, j
                count += 1
    return count


@njit(cache=True, error_model="numpy", parallel=True, fastmath=FLAGS)
def nearest(rows, squares, starts, asked, out):
    """Fill `out[m, k]` with the least of `squares[i] - 2 rows[i] asked[:, k]` over the rows i of each group m.

    Its rows are from ``starts[m]`` to ``starts[m + 1]``; the innermost loops run along k, eight products a time.
    """
    eights = asked.shape[0] // 8 * 8
    for m in prange(len(starts) - 1):
        product = np.empty(asked.shape[1], np.float32)
        for i in range(starts[m], starts[m + 1]):
            product[:] = np.float32(0.0)
            for d in range(0, eights, 8):
                a, b, c, e = rows[i, d], rows[i, d + 1], rows[i, d + 2], rows[i, d + 3]
                f, g, h, j = rows[i, d + 4], rows[i, d + 5], rows[i, d + 6], rows[i, d + 7]
                for k in range(asked.shape[1]):
                    product[k] += (
                        (a * asked[d, k] + b * asked[d + 1, k]) + (c * asked[d + 2, k] + e * asked[d + 3, k])
                    ) + ((f * asked[d + 4, k] + g * asked[d + 5, k]) + (h * asked[d + 6, k] + j * asked[d + 7, k]))
            for d in range(eights, asked.shape[0]):
                value = rows[i, d]
                for k in range(asked.shape[1]):
                    product[k] += value * asked[d, k]
            for k in range(asked.shape[1]):
                out[m, k] = min(out[m, k], squares[i] - np.float32(2.0) * product[k])


@njit(cache=True, error_model="numpy", fastmath=FLAGS)
def two_likest(rows, squares, asked, likest):
    """Fill `likest` (k, 2) with the rows of which `squares[i] - 2 rows[i] asked[k]` is least, and second least."""
    for k in range(len(asked)):
        least, second = np.float32(np.inf), np.float32(np.inf)
        for i in range(len(rows)):
            product = np.float32(0.0)
            for d in range(rows.shape[1]):
                product += rows[i, d] * asked[k, d]
            value = squares[i] - np.float32(2.0) * product
            if value < least:
                second, likest[k, 1] = least, likest[k, 0]
                least, likest[k, 0] = value, i
            elif value < second:
                second, likest[k, 1] = value, i
