"""Normals as cross products of the tangents of circles through a vertex and pairs of its neighbors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_opposed import edge_vectors, most_opposite
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

SIDELESS = 1e-9
"""A cross product with a smaller share of its length along the reference has no reliable sign."""

STRAIGHT = 1e-12
"""A tangent shorter than this share of the vectors it is the difference of has no direction."""


@njit(cache=True, error_model="numpy")
def _tangents(edges, pairs, kept, directions):
    """Fill the unit tangents of the circles through vertex and pairs: a / |a|^2 - b / |b|^2; return how many."""
    count = 0
    for k in range(kept):
        a, b = pairs[k, 0], pairs[k, 1]
        one, other, square = edges[a, 3] * edges[a, 3], edges[b, 3] * edges[b, 3], 0.0
        for axis in range(3):
            directions[count, axis] = edges[a, axis] / one - edges[b, axis] / other
            square += directions[count, axis] * directions[count, axis]
        if square > STRAIGHT * STRAIGHT * (1.0 / one + 1.0 / other):
            directions[count] /= math.sqrt(square)
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def _oriented_sum(directions, count, rx, ry, rz):
    """Return the sum of the cross products of all pairs of directions, each with the sign of (rx, ry, rz)."""
    tx = ty = tz = 0.0
    for a in range(count):
        for b in range(a + 1, count):
            x = directions[a, 1] * directions[b, 2] - directions[a, 2] * directions[b, 1]
            y = directions[a, 2] * directions[b, 0] - directions[a, 0] * directions[b, 2]
            z = directions[a, 0] * directions[b, 1] - directions[a, 1] * directions[b, 0]
            side = x * rx + y * ry + z * rz
            if side * side <= SIDELESS * SIDELESS * (x * x + y * y + z * z):
                continue  # in the tangent plane
            side = math.copysign(1.0, side)
            tx += side * x
            ty += side * y
            tz += side * z
    return tx, ty, tz


@Both
def chen_schmitt(centers, offsets, members, points, reference, normalized, normals, reasons):
    """Fill the normal per row from the most opposite pairs of neighbors, as many pairs as neighbors."""
    for row in prange(centers.shape[0]):
        start, stop = offsets[row], offsets[row + 1]
        valence = stop - start
        if valence < 3:
            reasons[row] = FEW
            continue
        edges, pairs, directions = np.empty((valence, 4)), np.empty((valence, 2), np.int64), np.empty((valence, 3))
        count, _ = edge_vectors(points, centers[row], members, start, stop, edges)
        kept = most_opposite(edges, count, normalized, pairs, np.empty(valence)) if count >= 3 else 0
        count = _tangents(edges, pairs, kept, directions)
        rx, ry, rz = reference[row, 0], reference[row, 1], reference[row, 2]
        x, y, z = _oriented_sum(directions, count, rx, ry, rz)
        length = math.sqrt(x * x + y * y + z * z)
        if not length > 1e-10 * valence or rx * rx + ry * ry + rz * rz == 0.0:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = x / length, y / length, z / length
        reasons[row] = FOUND
