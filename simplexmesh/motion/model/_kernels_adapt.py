"""Kernels of curvature-adapted metric parameters: discrete curvedness, and the parameters that follow from it."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from numba import prange

from simplexmesh._base._kernels_both import Both


@Both
def curvedness(vertices, normals, neighbors, shortest, out):
    """Fill the root mean square over the neighbors of the change of normal per edge length, at least `shortest`."""
    for i in prange(vertices.shape[0]):
        total = 0.0
        for j in range(3):
            k = neighbors[i, j]
            x, y, z = vertices[k, 0] - vertices[i, 0], vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
            a, b, c = normals[k, 0] - normals[i, 0], normals[k, 1] - normals[i, 1], normals[k, 2] - normals[i, 2]
            length2 = max(x * x + y * y + z * z, shortest * shortest)
            total += (a * a + b * b + c * c) / length2 if length2 > 0.0 else 0.0
        out[i] = math.sqrt(total / 3.0)


@Both
def adapted(metric, size, floor, neighbors, strength, lowest, highest, out):
    """Fill the mean of `metric` and ``1/3 + strength dC_j``, `strength` reduced to keep this in lowest..highest."""
    for i in prange(metric.shape[0]):
        a, b, c = abs(size[neighbors[i, 0]]), abs(size[neighbors[i, 1]]), abs(size[neighbors[i, 2]])
        mean = (a + b + c) / 3.0
        scale = 1.0 / max(abs(size[i]), floor)
        a, b, c = (a - mean) * scale, (b - mean) * scale, (c - mean) * scale
        share = strength
        most, least = max(a, b, c), min(a, b, c)
        if most > 0.0:
            share = min(share, (highest - 1.0 / 3.0) / most)
        if least < 0.0:
            share = min(share, (lowest - 1.0 / 3.0) / least)
        out[i, 0] = 0.5 * (metric[i, 0] + 1.0 / 3.0 + share * a)
        out[i, 1] = 0.5 * (metric[i, 1] + 1.0 / 3.0 + share * b)
        out[i, 2] = 0.5 * (metric[i, 2] + 1.0 / 3.0 + share * c)
