"""The rim of a hole: a closed line in space, moved by the force of 1-simplex meshes instead of the surface's."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from numba import njit

from simplexmesh.motion._kernels import FAST


@njit(cache=True, error_model="numpy", fastmath=FAST)
def rim_targets(vertices, rim, before, after, bend, tangent, out):
    """Fill, per rim vertex, where curvature continuity along the rim wants it, its neighbors evenly on either side.

    `rim[k]` is a vertex, `before[k]` and `after[k]` the rows of `rim` it lies between. The curvature vectors of the two
    neighbors are carried to the vertex by the smallest rotation between tangents, so that circles are at rest.
    """
    count = rim.shape[0]
    for k in range(count):
        p, a, b = vertices[rim[k]], vertices[rim[before[k]]], vertices[rim[after[k]]]
        chord2 = 0.0
        for j in range(3):
            chord2 += (b[j] - a[j]) ** 2
        along = 0.0
        chord = math.sqrt(chord2)
        for j in range(3):
            tangent[k, j] = (b[j] - a[j]) / chord if chord > 0.0 else 0.0
            along += (p[j] - 0.5 * (a[j] + b[j])) * tangent[k, j]
        # curvature of the circle through the three points, as a vector from p towards the chord's side, reversed
        size2 = 0.0
        for j in range(3):
            bend[k, j] = p[j] - 0.5 * (a[j] + b[j]) - along * tangent[k, j]
            size2 += bend[k, j] ** 2
        r2 = 0.25 * chord2
        power = r2 - along * along - size2
        radius_term = math.sqrt(4.0 * size2 * r2 + power * power)
        scale = 2.0 / radius_term if radius_term > 0.0 else 0.0
        for j in range(3):
            bend[k, j] *= scale
    for k in range(count):
        a, b = vertices[rim[before[k]]], vertices[rim[after[k]]]
        wanted = 0.5 * bend[k]
        for other in (before[k], after[k]):
            cosine = crossing = 0.0
            for j in range(3):
                cosine += tangent[k, j] * tangent[other, j]
                crossing += tangent[k, j] * bend[other, j]
            if cosine > -0.9:
                for j in range(3):
                    carried = bend[other, j] - crossing / (1.0 + cosine) * (tangent[k, j] + tangent[other, j])
                    wanted[j] += 0.25 * carried
        size2 = r2 = 0.0
        for j in range(3):
            size2 += wanted[j] ** 2
            r2 += 0.25 * (b[j] - a[j]) ** 2
        sine2 = size2 * r2
        height = r2 / (1.0 + math.sqrt(1.0 - sine2)) if sine2 < 1.0 else r2 / math.sqrt(sine2)
        for j in range(3):
            out[k, j] = 0.5 * (a[j] + b[j]) + height * wanted[j]
