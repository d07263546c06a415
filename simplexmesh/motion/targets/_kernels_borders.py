"""Boundary criteria of points: the largest angular gap between neighbors, and the offset of their mean."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_algebra import principal_axes, tangents


@njit(cache=True, error_model="numpy", parallel=True)
def boundary_criteria(points, rows, near, normals, known, gap, offset):
    """Fill the largest angular `gap` between the neighbors (m, k) of points `rows` (m,) and the `offset` of their mean.

    Computed in the tangent planes with `normals` (m, 3), which are filled unless they are `known`; `offset` is relative
    to the distance of the farthest neighbor.
    """
    count = near.shape[1]
    for m in prange(len(rows)):
        u, v, angles, row = np.zeros(3), np.zeros(3), np.zeros(count), rows[m]
        if not known:
            A, V = np.zeros((3, 3)), np.zeros((3, 3))
            least = principal_axes(points, row, near[m], u, A, V)
            for a in range(3):
                normals[m, a] = V[a, least]
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
        gap[m] = angles[0] + 2 * math.pi - angles[count - 1]
        for k in range(1, count):
            gap[m] = max(gap[m], angles[k] - angles[k - 1])
        offset[m] = math.sqrt(x * x + y * y) / max(math.sqrt(farthest), 1e-300)
