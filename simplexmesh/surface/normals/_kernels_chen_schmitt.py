"""Normals as vector products of the tangents of circles through a vertex and pairs of its neighbors."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface.reasons import DEGENERATE, FEW, FOUND

TIED = 1e-9
"""Oppositions that differ by less than this share of the farthest neighbor's square are the same: rounding must not
choose between them. As little of a product along the reference does not tell its side."""


@njit(cache=True, error_model="numpy")
def _most_opposed(points, i, members, start, stop, normalized, pairs, opposed):
    """Fill as many pairs as there are neighbors: those with the largest (P - P_a) . (P_b - P), of equals the first."""
    most, kept, widest = stop - start, 0, 0.0
    for a in range(start, stop):
        square = 0.0
        for axis in range(3):
            square += (points[members[a], axis] - points[i, axis]) ** 2
        widest = max(widest, 1.0 if normalized else square)
    for a in range(start, stop):
        for b in range(a + 1, stop):
            across = one = other = 0.0
            for axis in range(3):
                x, y = points[members[a], axis] - points[i, axis], points[members[b], axis] - points[i, axis]
                across -= x * y
                one += x * x
                other += y * y
            if normalized:
                across = across / math.sqrt(one * other) if one * other > 0.0 else -1.0
            if kept == most and across <= opposed[most - 1] + TIED * widest:
                continue
            place = min(kept, most - 1)
            while place > 0 and across > opposed[place - 1] + TIED * widest:
                opposed[place] = opposed[place - 1]
                pairs[place, 0], pairs[place, 1] = pairs[place - 1, 0], pairs[place - 1, 1]
                place -= 1
            opposed[place], pairs[place, 0], pairs[place, 1] = across, members[a], members[b]
            kept = min(kept + 1, most)


@njit(cache=True, error_model="numpy")
def _tangent(points, i, a, b, out):
    """Fill the unit tangent at i of the circle through a, i and b: along a / |a|^2 - b / |b|^2, from i."""
    one = other = 0.0
    for axis in range(3):
        one += (points[a, axis] - points[i, axis]) ** 2
        other += (points[b, axis] - points[i, axis]) ** 2
    if one == 0.0 or other == 0.0:
        return False
    length = 0.0
    for axis in range(3):
        out[axis] = other * (points[a, axis] - points[i, axis]) - one * (points[b, axis] - points[i, axis])
        length += out[axis] * out[axis]
    if length <= 1e-24 * one * other * (one + other):
        return False
    out /= math.sqrt(length)
    return True


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
            if side * side <= TIED * TIED * (x * x + y * y + z * z):
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
        start, stop, i = offsets[row], offsets[row + 1], centers[row]
        valence = stop - start
        if valence < 3:
            reasons[row] = FEW
            continue
        pairs, opposed = np.zeros((valence, 2), np.int64), np.zeros(valence)
        _most_opposed(points, i, members, start, stop, normalized, pairs, opposed)
        lines, told = np.zeros((valence, 3)), 0
        for k in range(valence):
            told += _tangent(points, i, pairs[k, 0], pairs[k, 1], lines[told])
        rx, ry, rz = reference[row, 0], reference[row, 1], reference[row, 2]
        x, y, z = _sum_of_products(lines, told, rx, ry, rz)
        length = math.sqrt(x * x + y * y + z * z)
        if not length > 1e-10 * valence or rx * rx + ry * ry + rz * rz == 0.0:
            reasons[row] = DEGENERATE
            continue
        normals[row, 0], normals[row, 1], normals[row, 2] = x / length, y / length, z / length
        reasons[row] = FOUND
