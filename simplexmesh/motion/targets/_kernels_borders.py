"""Which points have their neighbors on one side. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_njit import njit
from simplexmesh.motion.targets._kernels_algebra import principal_axes, tangents


@njit(cache=True, error_model="numpy", parallel=True)
def sides(points, rows, near, normals, known, free, off):
    """Fill how wide an angle the neighbors (m, k) of points `rows` (m,) leave free, and how far off their mean is.

    Seen in planes through them with `normals` (m, 3), which are filled unless they are `known`; `off` is in the
    distance of the farthest.
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
        free[m] = angles[0] + 2 * math.pi - angles[count - 1]
        for k in range(1, count):
            free[m] = max(free[m], angles[k] - angles[k - 1])
        off[m] = math.sqrt(x * x + y * y) / max(math.sqrt(farthest), 1e-300)
