"""Normals as vector products of the tangents of circles through a vertex and pairs of its neighbors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh._kernels_njit import njit
from simplexmesh.surface._kernels_opposed import arms_of, most_opposed
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

SIDELESS = 1e-9
"""A product with a smaller share of its length along the reference does not tell its side."""

STRAIGHT = 1e-12
"""A tangent that is shorter than this share of what it is the difference of has no direction."""


@njit(cache=True, error_model="numpy")
def _tangents(arms, pairs, kept, lines):
    """Fill the unit tangents of the circles through vertex and pairs: a / |a|^2 - b / |b|^2; return how many."""
    told = 0
    for k in range(kept):
        a, b = pairs[k, 0], pairs[k, 1]
        one, other, square = arms[a, 3] * arms[a, 3], arms[b, 3] * arms[b, 3], 0.0
        for axis in range(3):
            lines[told, axis] = arms[a, axis] / one - arms[b, axis] / other
            square += lines[told, axis] * lines[told, axis]
        if square > STRAIGHT * STRAIGHT * (1.0 / one + 1.0 / other):
            lines[told] /= math.sqrt(square)
            told += 1
    return told


@njit(cache=True, error_model="numpy")
def _sum_of_products(lines, count, rx, ry, rz):
    """Return the sum of the vector products of all pairs of lines, each on the side of (rx, ry, rz)."""
    tx = ty = tz = 0.0
    for a in range(count):
        for b in range(a + 1, count):
            x = lines[a, 1] * lines[b, 2] - lines[a, 2] * lines[b, 1]
            y = lines[a, 2] * lines[b, 0] - lines[a, 0] * lines[b, 2]
            z = lines[a, 0] * lines[b, 1] - lines[a, 1] * lines[b, 0]
            side = x * rx + y * ry + z * rz
            if side * side <= SIDELESS * SIDELESS * (x * x + y * y + z * z):
                continue  # it lies in the tangent plane and looks to neither side
            side = math.copysign(1.0, side)
            tx += side * x
            ty += side * y
            tz += side * z
    return tx, ty, tz


@Both
def chen_schmitt(centers, offsets, members, points, reference, normalized, normals, reasons):
    """Fill the normal per row from as many most opposite pairs as there are neighbors."""
    for row in prange(centers.shape[0]):
        start, stop = offsets[row], offsets[row + 1]
        valence = stop - start
        if valence < 3:
            reasons[row] = FEW
            continue
        arms, pairs, lines = np.empty((valence, 4)), np.empty((valence, 2), np.int64), np.empty((valence, 3))
        count, _ = arms_of(points, centers[row], members, start, stop, arms)
        kept = most_opposed(arms, count, normalized, pairs, np.empty(valence)) if count >= 3 else 0
        told = _tangents(arms, pairs, kept, lines)
        rx, ry, rz = reference[row, 0], reference[row, 1], reference[row, 2]
        x, y, z = _sum_of_products(lines, told, rx, ry, rz)
        length = math.sqrt(x * x + y * y + z * z)
        if not length > 1e-10 * valence or rx * rx + ry * ry + rz * rz == 0.0:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = x / length, y / length, z / length
        reasons[row] = FOUND
