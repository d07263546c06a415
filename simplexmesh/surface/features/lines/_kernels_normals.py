"""Averages of normals over patches of triangles. Arrays in, arrays filled; no checks."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh._base._kernels_njit import njit
from simplexmesh._base._kernels_rows import by_rows


@by_rows()
def fill_means(begin, end, offsets, members, areas, normals, means, spreads):
    """Fill the mean normal of each patch, and how much its normals differ: 0 if they agree, at most 1."""
    for t in range(begin, end):
        x = y = z = total = 0.0
        for k in range(offsets[t], offsets[t + 1]):
            u = members[k]
            x, y, z = x + areas[u] * normals[u, 0], y + areas[u] * normals[u, 1], z + areas[u] * normals[u, 2]
            total += areas[u]
        length = max(math.sqrt(x * x + y * y + z * z), 1e-300)
        means[t, 0], means[t, 1], means[t, 2] = x / length, y / length, z / length
        spreads[t] = 1.0 - length / total if total > 0 else 1.0


@by_rows(2000)
def fill_weights(begin, end, offsets, members, centers, areas, weights):
    """Fill the weights of the members of each patch: areas, less by a Gaussian as wide as the mean distance."""
    for t in range(begin, end):
        total = width = 0.0
        for k in range(offsets[t], offsets[t + 1]):
            square = 0.0
            for axis in range(3):
                square += (centers[members[k], axis] - centers[t, axis]) ** 2
            weights[k] = math.sqrt(square)
            width, total = width + weights[k] * areas[members[k]], total + areas[members[k]]
        width = max(width / max(total, 1e-300), 1e-300)
        for k in range(offsets[t], offsets[t + 1]):
            weights[k] = areas[members[k]] * math.exp(-0.5 * (weights[k] / width) ** 2)


@njit(cache=True, error_model="numpy")
def _guide(patch, spreads, least_gain):
    """Return the triangle of a patch whose own patch is the most consistent; the first unless that gains enough."""
    best = patch[0]
    for u in patch:
        if spreads[u] < spreads[best]:
            best = u
    return best if spreads[best] <= least_gain * spreads[patch[0]] else patch[0]


@by_rows()
def fill_guides(begin, end, offsets, members, normals, means, spreads, least_gain, limits, guides):
    """Fill the mean normal of the most consistent patch around triangles, their own where it differs too much."""
    for t in range(begin, end):
        best = _guide(members[offsets[t] : offsets[t + 1]], spreads, least_gain)
        pure = spreads[best] <= limits[best]
        for axis in range(3):
            guides[t, axis] = means[best, axis] if pure else normals[t, axis]


@by_rows(2000)
def fill_averages(begin, end, offsets, members, weights, guides, normals, widths, out):
    """Fill the average of the normals in each patch, weighted, and by how near their guides are to its own."""
    for t in range(begin, end):
        x = y = z = 0.0
        for k in range(offsets[t], offsets[t + 1]):
            u, square = members[k], 0.0
            for axis in range(3):
                square += (guides[t, axis] - guides[u, axis]) ** 2
            weight = weights[k] * math.exp(-0.5 * square / (widths[t] * widths[t]))
            x, y, z = x + weight * normals[u, 0], y + weight * normals[u, 1], z + weight * normals[u, 2]
        length = math.sqrt(x * x + y * y + z * z)
        for axis, value in enumerate((x, y, z)):
            out[t, axis] = value / length if length > 0 else guides[t, axis]
