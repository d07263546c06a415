"""Distances of points from surfaces of revolution, and their normal equations. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simplexmesh._base._kernels_njit import FAST, LEAN, njit
from simplexmesh._base.arrays import Array
from simplexmesh.numerics._kernels_vectors import cross_product, plus, row, unit

jit = njit(cache=True, error_model="numpy", fastmath=FAST)
lean = njit(**LEAN)

PLANE, SPHERE, CYLINDER, TAPER, CONE, TORUS, LINE, CIRCLE = range(8)
"""Kinds of surfaces, and curves."""


class Revolution(NamedTuple):
    """The kind of a primitive, a point of its axis, its frame (3, 3) and the measures of its shape."""

    kind: int
    origin: Array
    frame: Array
    shape: Array


@njit(cache=True, error_model="numpy")
def framed(axis):
    """Return the frame (3, 3) about an axis, last: as `tangents` of stacks, but many times as fast for one."""
    x, y, z = axis[0], axis[1], axis[2]
    first = unit((1.0 - x * x, -x * y, -x * z) if abs(x) < 0.9 else (-y * x, 1.0 - y * y, -y * z))
    return np.array((first, cross_product((x, y, z), first), (x, y, z)))


@jit
def possible(kind, shape):
    """Return whether a primitive of a kind may have these measures."""
    if kind == TAPER:
        return 0.0 < shape[0] < math.inf and abs(shape[1]) < math.pi / 2
    for k in range(len(shape)):
        if not 0.0 < shape[k] < math.inf:
            return False
    return shape[0] < math.pi / 2 if kind == CONE else kind != TORUS or shape[1] <= shape[0]


@njit(cache=True, error_model="numpy")
def moved(surface, moves, step):
    """Return a surface moved by a step (p,) in its chart, to measures that may be impossible."""
    kind, origin, frame, shape = surface
    motion, there, measures = np.zeros(5), np.zeros(3), shape.copy()
    for k in range(5):
        if moves[k] >= 0:
            motion[k] = step[moves[k]]
    tilted = plus(plus(row(frame, 2), row(frame, 0), motion[0]), row(frame, 1), motion[1])
    for a in range(3):
        there[a] = origin[a] + motion[2] * frame[0, a] + motion[3] * frame[1, a] + motion[4] * frame[2, a]
    for k in range(len(shape)):
        measures[k] += step[len(step) - len(shape) + k]
    return Revolution(kind, there, framed(unit(tilted)), measures)


@lean
def profile(kind, shape, rho, z):
    """Return the distance from a profile, and its derivatives by rho, z and two measures."""
    if kind == PLANE:
        return z, 0.0, 1.0, 0.0, 0.0
    if kind == CYLINDER:
        return rho - shape[0], 1.0, 0.0, -1.0, 0.0
    if kind == LINE:
        return rho, 1.0, 0.0, 0.0, 0.0
    if kind in (SPHERE, TORUS, CIRCLE):
        out = rho if kind == SPHERE else rho - shape[0]
        far = math.hypot(out, z)
        some = max(far, 1e-300)
        if kind == SPHERE:
            return far - shape[0], out / some, z / some, -1.0, 0.0
        return far - (shape[1] if kind == TORUS else 0.0), out / some, z / some, -out / some, -1.0
    if kind == CONE:
        cos, sin = math.cos(shape[0]), math.sin(shape[0])
        if z * cos + rho * sin <= 0:  # behind the apex
            far = math.hypot(rho, z)
            some = max(far, 1e-300)
            return far, rho / some, z / some, 0.0, 0.0
        return cos * rho - sin * z, cos, -sin, -sin * rho - cos * z, 0.0
    cos, sin = math.cos(shape[1]), math.sin(shape[1])
    if (sin * z + cos * shape[0]) * cos + sin * sin * rho <= 0:
        above = z + shape[0] * cos / sin
        far = max(math.hypot(rho, above), 1e-300)
        up = above / far
        return far, rho / far, up, up * cos / sin, -up * shape[0] / (sin * sin)
    out = rho - shape[0]
    return cos * out - sin * z, cos, -sin, -cos, -sin * out - cos * z


@lean
def at_point(surface, points, i):
    """Return a point's place in the frame, its distance, the gradient in the frame, and derivatives by measures."""
    kind, origin, frame, shape = surface
    dx, dy, dz = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
    x = frame[0, 0] * dx + frame[0, 1] * dy + frame[0, 2] * dz
    y = frame[1, 0] * dx + frame[1, 1] * dy + frame[1, 2] * dz
    z = frame[2, 0] * dx + frame[2, 1] * dy + frame[2, 2] * dz
    rho = math.sqrt(x * x + y * y)
    distance, by_rho, gz, by_first, by_second = profile(kind, shape, rho, z)
    out = by_rho / rho if rho > 0 else 0.0
    return x, y, z, distance, out * x, out * y, gz, by_first, by_second


@jit
def fill_distances(surface, points, distances, gradients):
    """Fill signed distances (n,) and the directions (n, 3) in which they grow."""
    for i in range(len(points)):
        _, _, _, distances[i], gx, gy, gz, _, _ = at_point(surface, points, i)
        for k in range(3):
            gradients[i, k] = gx * surface.frame[0, k] + gy * surface.frame[1, k] + gz * surface.frame[2, k]


@lean
def fill_row(surface, moves, points, i, row):
    """Fill the derivatives (p,) of a point's distance by the parameters of a chart; return the distance."""
    x, y, z, distance, gx, gy, gz, by_first, by_second = at_point(surface, points, i)
    measures = len(surface.shape)
    first = len(row) - measures
    if moves[0] >= 0:
        row[moves[0]], row[moves[1]] = gz * x - gx * z, gz * y - gy * z
    if moves[2] >= 0:
        row[moves[2]], row[moves[3]] = -gx, -gy
    if moves[4] >= 0:
        row[moves[4]] = -gz
    if measures > 0:
        row[first] = by_first
    if measures > 1:
        row[first + 1] = by_second
    return distance


@jit
def fill_rows(surface, moves, points, rows):
    """Fill derivatives (n, p) of distances."""
    for i in range(len(points)):
        fill_row(surface, moves, points, i, rows[i])


@jit
def normal_equations(surface, moves, points, weights, loss_scale, matrix, downhill):
    """Add to the normal matrix (p, p) and the downhill vector (p,) of the chart; return the cost.

    `moves` are the columns of two tilts, two shifts across and one along the axis, -1 where there is none, and those of
    the measures of the shape come last. No weights are all 1; an infinite scale is no loss.
    """
    p = len(downhill)
    row = np.zeros(p)
    cost = 0.0
    for i in range(len(points)):
        distance = fill_row(surface, moves, points, i, row)
        weight = weights[i] if len(weights) else 1.0
        square = distance * distance
        less = 1.0 / (1.0 + square / (loss_scale * loss_scale))
        cost += weight * square * less
        weight *= less * less
        for k in range(p):
            part = weight * row[k]
            downhill[k] -= part * distance
            for j in range(k + 1):
                matrix[k, j] += part * row[j]
    for k in range(p):
        for j in range(k):
            matrix[j, k] = matrix[k, j]
    return cost
