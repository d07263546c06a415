"""Local planes and quadrics through the neighbors of points. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_algebra import principal_axes


@njit(cache=True, error_model="numpy", parallel=True)
def fit_planes(points, near, normals, variance, projected):
    """Fit planes to neighbors `near` (n, k), the point itself first.

    `normals` (n, 3) get unit normals of either sign, `variance` (n,) the mean squared distance of the neighbors to the
    plane, `projected` (n, 3) the projection of the point to it.
    """
    n, count = near.shape
    for i in prange(n):
        A, V, middle = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
        least = principal_axes(points, near[i, 0], near[i], middle, A, V)
        variance[i] = max(0.0, A[least, least] / count)
        offset = 0.0
        for a in range(3):
            normals[i, a] = V[a, least]
            offset -= middle[a] * V[a, least]
        for a in range(3):
            projected[i, a] = points[near[i, 0], a] - offset * V[a, least]


@njit(cache=True, error_model="numpy")
def _solve(A, x):
    """Solve a symmetric positive definite system for x, in place, by elimination; return whether it is regular."""
    n = len(x)
    for i in range(n):
        if A[i, i] <= 1e-9:
            return False
        for j in range(i + 1, n):
            factor = A[j, i] / A[i, i]
            for k in range(i, n):
                A[j, k] -= factor * A[i, k]
            x[j] -= factor * x[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= A[i, k] * x[k]
        x[i] /= A[i, i]
    return True


@njit(cache=True, error_model="numpy", parallel=True)
def fit_quadrics(points, near, normals, projected, quadric_normals):
    """Fit quadratic height functions over planes to neighbors `near` (n, k), the point itself first.

    `projected` (n, 3) get the projections of the points to the graphs along `normals` (n, 3), `quadric_normals` the
    unit normals there. Where a fit is singular, point and normal are copied.
    """
    n, count = near.shape
    for i in prange(n):
        A, x, row, frame = np.zeros((6, 6)), np.zeros(6), np.zeros(6), np.zeros((3, 3))
        first = points[near[i, 0]]
        axis = 0 if abs(normals[i, 0]) < 0.6 else 1
        length = math.sqrt(1 - normals[i, axis] ** 2)
        for a in range(3):
            frame[2, a] = normals[i, a]
            frame[0, a] = ((1.0 if a == axis else 0.0) - normals[i, axis] * normals[i, a]) / length
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            frame[1, a] = frame[2, b] * frame[0, c] - frame[2, c] * frame[0, b]
        reach = 1e-300
        for k in range(count):
            squared = 0.0
            for a in range(3):
                squared += (points[near[i, k], a] - first[a]) ** 2
            reach = max(reach, math.sqrt(squared))
        for k in range(count):
            u = v = w = 0.0
            for a in range(3):
                d = (points[near[i, k], a] - first[a]) / reach
                u += d * frame[0, a]
                v += d * frame[1, a]
                w += d * frame[2, a]
            row[0], row[1], row[2], row[3], row[4], row[5] = 1.0, u, v, u * u, u * v, v * v
            for a in range(6):
                x[a] += row[a] * w / count
                for b in range(6):
                    A[a, b] += row[a] * row[b] / count
        solved = _solve(A, x)
        slope = math.sqrt(1 + x[1] ** 2 + x[2] ** 2)
        for a in range(3):
            projected[i, a] = first[a] + (x[0] * reach * frame[2, a] if solved else 0.0)
            quadric_normals[i, a] = normals[i, a]
            if solved:
                quadric_normals[i, a] = (normals[i, a] - x[1] * frame[0, a] - x[2] * frame[1, a]) / slope
