"""Results of the adaptive estimator: curvatures and principal axes of a jet, and weighted means of several jets."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

from simplexmesh.surface.curvature.adaptive._kernels_balls import jit, unit
from simplexmesh.surface.reasons import FOUND


class Jet(NamedTuple):
    """Principal curvatures in radii, the direction of the first, the normal."""

    k1: float
    k2: float
    d1: tuple[float, float, float]
    normal: tuple[float, float, float]


@jit
def blend(row, share, jet, radius, expected, out):
    """Replace the result of a row by (1 - share) of itself plus `share` of a jet; the first replaces it wholly."""
    keep = 1.0 - share
    if out.reasons[row] != FOUND:
        share, keep = 1.0, 0.0
        out.reasons[row] = FOUND
    out.shape[row, 0] = keep * out.shape[row, 0] + share * jet.k1 / radius
    out.shape[row, 1] = keep * out.shape[row, 1] + share * jet.k2 / radius
    out.error[row] = math.sqrt(keep * out.error[row] ** 2 + share * expected * expected)
    out.scale[row] = keep * out.scale[row] + share * radius
    agree = out.d1[row, 0] * jet.d1[0] + out.d1[row, 1] * jet.d1[1] + out.d1[row, 2] * jet.d1[2]
    sign = math.copysign(1.0, agree)
    for axis in range(3):
        out.d1[row, axis] = keep * out.d1[row, axis] + share * sign * jet.d1[axis]
        out.normals[row, axis] = keep * out.normals[row, axis] + share * jet.normal[axis]


@jit
def normalize(row, out):
    """Make normal and direction of a row orthonormal."""
    nx, ny, nz = unit(out.normals[row, 0], out.normals[row, 1], out.normals[row, 2])
    tx, ty, tz = out.d1[row, 0], out.d1[row, 1], out.d1[row, 2]
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = unit(tx - along * nx, ty - along * ny, tz - along * nz)
    out.normals[row, 0], out.normals[row, 1], out.normals[row, 2] = nx, ny, nz
    out.d1[row, 0], out.d1[row, 1], out.d1[row, 2] = tx, ty, tz


@jit
def jet_of(x, frame):
    """Return the jet of the height polynomial x in a frame."""
    p, q = x[1], x[2]
    g = 1.0 + p * p + q * q
    root = math.sqrt(g)
    # shape operator -II I^-1 in the basis of the tangents (1, 0, p), (0, 1, q)
    r, s, t = -2.0 * x[3] / root, -x[4] / root, -2.0 * x[5] / root
    e, f, h = 1.0 + p * p, p * q, 1.0 + q * q
    a, b = (r * h - s * f) / g, (s * h - t * f) / g
    c, d = (s * e - r * f) / g, (t * e - s * f) / g
    mean, amplitude = 0.5 * (a + d), math.sqrt(max(0.25 * (a - d) ** 2 + b * c, 0.0))
    largest = mean + amplitude
    # eigenvector of [[a, b], [c, d]], from the row of the larger entries
    if abs(largest - a) + abs(b) > abs(largest - d) + abs(c):
        first, second = b, largest - a
    else:
        first, second = largest - d, c
    if first == 0.0 and second == 0.0:
        first = 1.0
    up = p * first + q * second
    length = math.sqrt(first * first + second * second + up * up)
    d1 = combined(first / length, second / length, up / length, frame)
    normal = combined(-p / root, -q / root, 1.0 / root, frame)
    return Jet(mean + amplitude, mean - amplitude, d1, normal)


@jit
def combined(a, b, c, frame):
    """Return the vector of three coordinates in a frame."""
    return (
        a * frame[0, 0] + b * frame[1, 0] + c * frame[2, 0],
        a * frame[0, 1] + b * frame[1, 1] + c * frame[2, 1],
        a * frame[0, 2] + b * frame[1, 2] + c * frame[2, 2],
    )
