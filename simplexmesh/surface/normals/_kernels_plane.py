"""Normals of the planes that lie closest to a vertex and its neighbors."""
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
"""Points whose second largest spread, squared, is less than this share of the largest lie on a line."""


@njit(cache=True, error_model="numpy")
def _spread(points, i, members, start, stop, mean, table):
    """Fill the mean of center and neighbors, and the upper left of the table with the products around it."""
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
            table[p, q] = table[q, p] = total


@njit(cache=True, error_model="numpy")
def _smallest(table, axes, n):
    """Return which eigenvalue is the smallest, and the largest two, once the table is diagonal."""
    diagonalize(table, axes, n)
    least, first, second = 0, 0.0, 0.0
    for k in range(n):
        if table[k, k] < table[least, least]:
            least = k
        if table[k, k] > first:
            first, second = table[k, k], first
        elif table[k, k] > second:
            second = table[k, k]
    return least, first, second


@Both
def planes(centers, offsets, members, points, homogeneous, normals, reasons):
    """Fill the normal of the least-squares plane per row, turned to either side.

    The plane passes through the mean of the points, or, if `homogeneous`, (n, d) of length one is sought that makes
    the sum of (n p + d)^2 least.
    """
    for row in prange(centers.shape[0]):
        start, stop, i = offsets[row], offsets[row + 1], centers[row]
        if stop - start < 2:
            reasons[row] = FEW
            continue
        mean, table, axes = np.zeros(3), np.zeros((4, 4)), np.zeros((4, 4))
        _spread(points, i, members, start, stop, mean, table)
        least, first, second = _smallest(table, axes, 3)
        if not second > STRAIGHT * first:
            reasons[row] = DEGENERATE
            continue
        if homogeneous:
            count = 1.0 + stop - start
            _spread(points, i, members, start, stop, mean, table)
            for p in range(3):
                mean[p] += points[i, p]
            for p in range(3):
                for q in range(3):
                    table[p, q] += count * mean[p] * mean[q]
                table[p, 3] = table[3, p] = count * mean[p]
            table[3, 3] = count
            least, first, second = _smallest(table, axes, 4)
        x, y, z = axes[0, least], axes[1, least], axes[2, least]
        length = math.sqrt(x * x + y * y + z * z)
        if not length > STRAIGHT:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = x / length, y / length, z / length
        reasons[row] = FOUND
