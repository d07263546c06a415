"""Pose-invariant descriptors and their nearest neighbors. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows

RADIAL_BINS, AXIAL_BINS = 5, 8
"""Bins of a spin image: distance from the axis, height along it."""

LENGTH_BINS, COSINE_BINS, RADIUS_BINS = 22, 4, 22
"""Bins of a global descriptor: length of pairs, cosine between their normals, distance from the center."""


@by_rows(20, fastmath=FAST)
def spin_images(begin, end, points, normals, chosen, radius, images):
    """Fill the spin images of chosen points: bilinear histograms of distance from the normal and height along it."""
    for k in range(begin, end):
        i = chosen[k]
        for j in range(len(points)):
            dx, dy, dz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            square = (dx * dx + dy * dy + dz * dz) / (radius * radius)
            if square > 1.0:
                continue
            height = (dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2]) / radius
            distance = math.sqrt(max(square - height * height, 0.0))
            weight = 1.0 - square * square
            x, y = distance * RADIAL_BINS - 0.5, (height + 1.0) * 0.5 * AXIAL_BINS - 0.5
            left, low = math.floor(x), math.floor(y)
            for a in range(2):
                for b in range(2):
                    fraction = (x - left if a else 1.0 - x + left) * (y - low if b else 1.0 - y + low)
                    column, row = min(max(left + a, 0), RADIAL_BINS - 1), min(max(low + b, 0), AXIAL_BINS - 1)
                    images[k, column * AXIAL_BINS + row] += weight * fraction


@njit(cache=True, error_model="numpy", fastmath=FAST)
def pair_histogram(points, normals, longest, pairs):
    """Count pairs of points by length and cosine between their normals, into `pairs` (LENGTH_BINS, COSINE_BINS)."""
    for i in range(len(points)):
        for j in range(i):
            dx, dy, dz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            cosine = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            a = min(int(length / longest * LENGTH_BINS), LENGTH_BINS - 1)
            b = min(max(int((cosine + 1.0) * 0.5 * COSINE_BINS), 0), COSINE_BINS - 1)
            pairs[a, b] += 1.0


@by_rows(2, fastmath=FAST)
def nearest(begin, end, rows, squares, starts, queries, out):
    """Fill `out[m, k]` with the minimum of ``squares[i] - 2 rows[i] @ queries[:, k]`` over the rows i of group m.

    Group m is ``starts[m] : starts[m + 1]``. The innermost loops run along k, with eight products at a time.
    """
    eights = queries.shape[0] // 8 * 8
    for m in range(begin, end):
        product = np.empty(queries.shape[1], np.float32)
        for i in range(starts[m], starts[m + 1]):
            product[:] = np.float32(0.0)
            for d in range(0, eights, 8):
                a, b, c, e = rows[i, d], rows[i, d + 1], rows[i, d + 2], rows[i, d + 3]
                f, g, h, j = rows[i, d + 4], rows[i, d + 5], rows[i, d + 6], rows[i, d + 7]
                for k in range(queries.shape[1]):
                    product[k] += (
                        (a * queries[d, k] + b * queries[d + 1, k]) + (c * queries[d + 2, k] + e * queries[d + 3, k])
                    ) + (
                        (f * queries[d + 4, k] + g * queries[d + 5, k])
                        + (h * queries[d + 6, k] + j * queries[d + 7, k])
                    )
            for d in range(eights, queries.shape[0]):
                value = rows[i, d]
                for k in range(queries.shape[1]):
                    product[k] += value * queries[d, k]
            for k in range(queries.shape[1]):
                out[m, k] = min(out[m, k], squares[i] - np.float32(2.0) * product[k])


@njit(cache=True, error_model="numpy", fastmath=FAST)
def two_nearest(rows, squares, queries, indices):
    """Fill `indices` (k, 2) with the rows i of the two smallest ``squares[i] - 2 rows[i] @ queries[k]``, in order."""
    for k in range(len(queries)):
        least, second = np.float32(np.inf), np.float32(np.inf)
        for i in range(len(rows)):
            product = np.float32(0.0)
            for d in range(rows.shape[1]):
                product += rows[i, d] * queries[k, d]
            value = squares[i] - np.float32(2.0) * product
            if value < least:
                second, indices[k, 1] = least, indices[k, 0]
                least, indices[k, 0] = value, i
            elif value < second:
                second, indices[k, 1] = value, i
