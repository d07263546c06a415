"""Which points have their neighbors on one side. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_algebra import diagonalize, tangents


@njit(cache=True, error_model="numpy")
def _smallest_axis_of(points, row, near, normal, A, V):
    """Fill the unit normal of the plane through the neighbors of a point; `A` and `V` are room for two matrices."""
    count = len(near)
    middle = np.zeros(3)
    for a in range(3):
        for k in range(count):
            middle[a] += points[near[k], a] - points[row, a]
        middle[a] /= count
    A[:] = 0.0
    for k in range(count):
        x = points[near[k], 0] - points[row, 0] - middle[0]
        y = points[near[k], 1] - points[row, 1] - middle[1]
        z = points[near[k], 2] - points[row, 2] - middle[2]
        A[0, 0] += x * x
        A[0, 1] += x * y
        A[0, 2] += x * z
        A[1, 1] += y * y
        A[1, 2] += y * z
        A[2, 2] += z * z
    A[1, 0], A[2, 0], A[2, 1] = A[0, 1], A[0, 2], A[1, 2]
    diagonalize(A, V)
    least = 0
    for a in range(1, 3):
        if A[a, a] < A[least, least]:
            least = a
    for a in range(3):
        normal[a] = V[a, least]


@njit(cache=True, error_model="numpy", parallel=True)
def sides(points, rows, near, normals, known, free, off):
    """Fill how wide an angle the neighbors (m, k) of points `rows` (m,) leave free, and how far off their mean is.

    Seen in planes through them with `normals` (m, 3), which are filled unless they are `known`; `off` is in the
    distance of the farthest.
    """
    count = near.shape[1]
    for m in prange(len(rows)):
        A, V, u, v, angles = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(count)
        row = rows[m]
        if not known:
            _smallest_axis_of(points, row, near[m], normals[m], A, V)
        tangents(normals[m, 0], normals[m, 1], normals[m, 2], u, v)
        x = y = farthest = 0.0
        for k in range(count):
            s = t = 0.0
            for a in range(3):
                d = points[near[m, k], a] - points[row, a]
                s += d * u[a]
                t += d * v[a]
            angles[k] = math.atan2(t, s)
            farthest = max(farthest, s * s + t * t)
            x += s / count
            y += t / count
        angles.sort()
        free[m] = angles[0] + 2 * math.pi - angles[count - 1]
        for k in range(1, count):
            free[m] = max(free[m], angles[k] - angles[k - 1])
        off[m] = math.sqrt(x * x + y * y) / max(math.sqrt(farthest), 1e-300)
