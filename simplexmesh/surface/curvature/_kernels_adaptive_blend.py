"""Results of the adaptive estimator: curvatures and principal axes of a jet, and weighted means of several jets."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math

from simplexmesh.surface.curvature._kernels_adaptive_balls import jit
from simplexmesh.surface.curvature._kernels_adaptive_jets import bending
from simplexmesh.surface.reasons import FOUND


@jit
def blend(row, share, jet, radius, expected, shape, d1, normals, error, used, reasons):
    """Replace the result of a row by (1 - share) of itself plus `share` of a jet; the first replaces it wholly."""
    keep = 1.0 - share
    if reasons[row] != FOUND:
        share, keep = 1.0, 0.0
        shape[row, 0] = shape[row, 1] = error[row] = used[row] = 0.0
        for axis in range(3):
            d1[row, axis] = normals[row, axis] = 0.0
    shape[row, 0] = keep * shape[row, 0] + share * jet[0] / radius
    shape[row, 1] = keep * shape[row, 1] + share * jet[1] / radius
    error[row] = math.sqrt(keep * error[row] ** 2 + share * expected * expected)
    used[row] = keep * used[row] + share * radius
    agree = 0.0
    for axis in range(3):
        agree += d1[row, axis] * jet[2 + axis]
    sign = math.copysign(1.0, agree)
    for axis in range(3):
        d1[row, axis] = keep * d1[row, axis] + share * sign * jet[2 + axis]
        normals[row, axis] = keep * normals[row, axis] + share * jet[5 + axis]


@jit
def normalize(row, shape, d1, normals, error, square):
    """Make normal and direction orthonormal; add the squared truncation error `square` to the error's variance."""
    length = math.sqrt(normals[row, 0] ** 2 + normals[row, 1] ** 2 + normals[row, 2] ** 2)
    along = 0.0
    for axis in range(3):
        normals[row, axis] /= length
        along += normals[row, axis] * d1[row, axis]
    for axis in range(3):
        d1[row, axis] -= along * normals[row, axis]
    length = math.sqrt(d1[row, 0] ** 2 + d1[row, 1] ** 2 + d1[row, 2] ** 2)
    for axis in range(3):
        d1[row, axis] /= length
    error[row] = math.sqrt(error[row] ** 2 + square)


@jit
def jet_curvatures(x, frame, jet):
    """Write k1, k2, the tangent of k1 and the normal of the height polynomial x, in a frame, to `jet`."""
    mean, gauss = bending(x)
    amplitude = math.sqrt(max(mean * mean - gauss, 0.0))
    jet[0], jet[1] = mean + amplitude, mean - amplitude
    p, q = x[1], x[2]
    g = 1.0 + p * p + q * q
    root = math.sqrt(g)
    # shape operator -II I^-1 in the basis of the tangents (1, 0, p), (0, 1, q)
    r, s, t = -2.0 * x[3] / root, -x[4] / root, -2.0 * x[5] / root
    e, f, h = 1.0 + p * p, p * q, 1.0 + q * q
    a, b = (r * h - s * f) / g, (s * h - t * f) / g
    c, d = (s * e - r * f) / g, (t * e - s * f) / g
    half, largest = 0.5 * (a + d), 0.5 * (a + d) + amplitude
    # eigenvector of [[a, b], [c, d]], from the row of the larger entries
    if abs(a - half) + abs(b) == 0.0 and abs(c) == 0.0:
        first, second = 1.0, 0.0
    elif abs(largest - a) + abs(b) > abs(largest - d) + abs(c):
        first, second = b, largest - a
    else:
        first, second = largest - d, c
    if first == 0.0 and second == 0.0:
        first = 1.0
    up = p * first + q * second
    length = math.sqrt(first * first + second * second + up * up)
    for axis in range(3):
        fu, fv, fn = frame[0, axis], frame[1, axis], frame[2, axis]
        jet[2 + axis] = (first * fu + second * fv + up * fn) / length
        jet[5 + axis] = (fn - p * fu - q * fv) / root
