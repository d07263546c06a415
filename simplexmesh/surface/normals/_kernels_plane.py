"""Normals of least-squares planes through a vertex and its neighbors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface.normals._kernels_small import diagonalize
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

STRAIGHT = 1e-12
"""Points whose second largest variance is less than this share of the largest are collinear."""


@njit(cache=True, error_model="numpy")
def _scatter(points, i, members, start, stop, mean, matrix):
    """Fill the mean of center and neighbors, seen from the center, and the upper left 3 x 3 with their scatter."""
    count = 1.0 + stop - start
    mean[:] = 0.0
    for m in range(start, stop):
        for axis in range(3):
            mean[axis] += (points[members[m], axis] - points[i, axis]) / count
    for p in range(3):
        for q in range(p, 3):
            total = mean[p] * mean[q]
            for m in range(start, stop):
                j = members[m]
                total += (points[j, p] - points[i, p] - mean[p]) * (points[j, q] - points[i, q] - mean[q])
            matrix[p, q] = matrix[q, p] = total


@njit(cache=True, error_model="numpy")
def _eigenvalues(matrix, axes, n):
    """Diagonalize; return the index of the smallest eigenvalue, and the largest two."""
    diagonalize(matrix, axes, n)
    least, first, second = 0, 0.0, 0.0
    for k in range(n):
        if matrix[k, k] < matrix[least, least]:
            least = k
        if matrix[k, k] > first:
            first, second = matrix[k, k], first
        elif matrix[k, k] > second:
            second = matrix[k, k]
    return least, first, second


@Both
def planes(centers, offsets, members, points, homogeneous, normals, reasons):
    """Fill the unit normal of the least-squares plane per row, with either sign.

    The plane passes through the mean of the points or, if `homogeneous`, is the unit 4-vector (n, d) that minimizes the
    sum of (n . p + d)^2.
    """
    for row in prange(centers.shape[0]):
        start, stop, i = offsets[row], offsets[row + 1], centers[row]
        if stop - start < 2:
            reasons[row] = FEW
            continue
        mean, matrix, axes = np.zeros(3), np.zeros((4, 4)), np.zeros((4, 4))
        _scatter(points, i, members, start, stop, mean, matrix)
        least, first, second = _eigenvalues(matrix, axes, 3)
        if not second > STRAIGHT * first:
            reasons[row] = DEGENERATE
            continue
        if homogeneous:
            count = 1.0 + stop - start
            _scatter(points, i, members, start, stop, mean, matrix)
            for p in range(3):
                mean[p] += points[i, p]
            for p in range(3):
                for q in range(3):
                    matrix[p, q] += count * mean[p] * mean[q]
                matrix[p, 3] = matrix[3, p] = count * mean[p]
            matrix[3, 3] = count
            least, first, second = _eigenvalues(matrix, axes, 4)
        x, y, z = axes[0, least], axes[1, least], axes[2, least]
        length = math.sqrt(x * x + y * y + z * z)
        if not length > STRAIGHT:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = x / length, y / length, z / length
        reasons[row] = FOUND
