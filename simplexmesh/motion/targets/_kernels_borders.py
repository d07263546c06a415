"""Boundary criteria of points: the largest angular gap between neighbors, and the offset of their mean."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._base._kernels_njit import njit
from simplexmesh.numerics._kernels_frames import tangents
from simplexmesh.numerics._kernels_local_fits import fit_plane
from simplexmesh.numerics._kernels_vectors import difference, dot, row


@njit(cache=True, error_model="numpy")
def _criteria(points, index, near, normal):
    """Return the largest angular gap of the neighbors of a point, and their mean's offset relative to the farthest."""
    count = len(near)
    angles = np.zeros(count)
    u0, u1, u2, v0, v1, v2 = tangents(normal[0], normal[1], normal[2])
    x = y = farthest = 0.0
    for k in range(count):
        d = difference(points, near[k], index)
        s, t = dot(d, (u0, u1, u2)), dot(d, (v0, v1, v2))
        angles[k] = math.atan2(t, s)
        farthest = max(farthest, s * s + t * t)
        x += s / count
        y += t / count
    angles.sort()
    gap = angles[0] + 2 * math.pi - angles[count - 1]
    for k in range(1, count):
        gap = max(gap, angles[k] - angles[k - 1])
    return gap, math.sqrt(x * x + y * y) / max(math.sqrt(farthest), 1e-300)


@njit(cache=True, error_model="numpy", parallel=True)
def boundary_criteria(points, rows, near, normals, known, gap, offset):
    """Fill angular gaps and offsets of means of the neighbors (m, k) of points, and their normals unless `known`."""
    for m in prange(len(rows)):
        if not known:
            fit_plane(points, near[m], row(points, rows[m]), math.inf, normals[m])
        gap[m], offset[m] = _criteria(points, rows[m], near[m], normals[m])
