"""Normals of least-squares planes through a vertex and its neighbors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import FAST, njit
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.numerics._kernels_matrices import diagonalize
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

STRAIGHT = 1e-12
"""Points whose second largest variance is less than this share of the largest are collinear."""


@njit(cache=True, error_model="numpy")
def _scatter(points, i, near, mean, matrix):
    """Fill the mean of center and neighbors, seen from the center, and the upper left 3 x 3 with their scatter."""
    mean[:] = 0.0
    for j in near:
        for axis in range(3):
            mean[axis] += (points[j, axis] - points[i, axis]) / (1.0 + near.shape[0])
    for p in range(3):
        for q in range(p, 3):
            total = mean[p] * mean[q]
            for j in near:
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


@by_rows(fastmath=FAST)
def planes(begin, end, centers, rows, points, homogeneous, normals, reasons):
    """Fill unit normals, of either sign, of planes through the mean or, if `homogeneous`, of least sum (n.p + d)^2."""
    for row in range(begin, end):
        i, near = centers[row], rows.members[rows.offsets[row] : rows.offsets[row + 1]]
        reasons[row] = FEW if near.shape[0] < 2 else DEGENERATE
        if near.shape[0] < 2:
            continue
        mean, matrix, axes = np.zeros(3), np.zeros((4, 4)), np.zeros((4, 4))
        _scatter(points, i, near, mean, matrix)
        least, first, second = _eigenvalues(matrix, axes, 3)
        if not second > STRAIGHT * first:
            continue
        if homogeneous:
            count = 1.0 + near.shape[0]
            _scatter(points, i, near, mean, matrix)
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
        if length > STRAIGHT:
            normals[row, 0], normals[row, 1], normals[row, 2] = x / length, y / length, z / length
            reasons[row] = FOUND
