"""Planes through the neighbors of points. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

SWEEPS = 10


@njit(cache=True, error_model="numpy")
def _diagonalized(A, V):
    """Make a symmetric 3 x 3 matrix diagonal, in place, by Jacobi's rotations; V becomes its eigenvectors."""
    V[:] = 0.0
    for i in range(3):
        V[i, i] = 1.0
    tiny = 1e-30 * (A[0, 0] + A[1, 1] + A[2, 2]) ** 2
    for _ in range(SWEEPS):
        if A[0, 1] ** 2 + A[0, 2] ** 2 + A[1, 2] ** 2 <= tiny:
            return
        for p in range(2):
            for q in range(p + 1, 3):
                if A[p, q] == 0.0:
                    continue
                theta = (A[q, q] - A[p, p]) / (2 * A[p, q])
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1))
                c = 1 / math.sqrt(t * t + 1)
                s = t * c
                r = 3 - p - q
                A[p, p] -= t * A[p, q]
                A[q, q] += t * A[p, q]
                A[p, q] = A[q, p] = 0.0
                one, other = A[p, r], A[q, r]
                A[p, r] = A[r, p] = c * one - s * other
                A[q, r] = A[r, q] = s * one + c * other
                for k in range(3):
                    one, other = V[k, p], V[k, q]
                    V[k, p] = c * one - s * other
                    V[k, q] = s * one + c * other


@njit(cache=True, error_model="numpy", parallel=True)
def fit_planes(points, near, normals, spread, smooth):
    """Fit a plane to points `near` (n, k), the nearest first.

    `normals` (n, 3) become unit normals of either sign, `spread` (n,) the mean squared distance of the points to
    the plane, `smooth` (n, 3) the nearest brought to it.
    """
    n, count = near.shape
    for i in prange(n):
        A, V, middle = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
        for k in range(count):
            for a in range(3):
                middle[a] += points[near[i, k], a] / count
        for k in range(count):
            x = points[near[i, k], 0] - middle[0]
            y = points[near[i, k], 1] - middle[1]
            z = points[near[i, k], 2] - middle[2]
            A[0, 0] += x * x
            A[0, 1] += x * y
            A[0, 2] += x * z
            A[1, 1] += y * y
            A[1, 2] += y * z
            A[2, 2] += z * z
        A[1, 0], A[2, 0], A[2, 1] = A[0, 1], A[0, 2], A[1, 2]
        _diagonalized(A, V)
        least = 0
        for a in range(1, 3):
            if A[a, a] < A[least, least]:
                least = a
        spread[i] = max(0.0, A[least, least] / count)
        lack = 0.0
        for a in range(3):
            normals[i, a] = V[a, least]
            lack += (points[near[i, 0], a] - middle[a]) * V[a, least]
        for a in range(3):
            smooth[i, a] = points[near[i, 0], a] - lack * V[a, least]
