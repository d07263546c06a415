"""Steps of damped least squares, and whole descents of surfaces of revolution. Arrays in, arrays out; no checks."""

# mypy: allow-untyped-defs

from __future__ import annotations

import math

import numpy as np

from simplexmesh._base._kernels_njit import njit
from simplexmesh.data.primitives._kernels_profiles import moved, normal_equations, possible
from simplexmesh.numerics._kernels_matrices import factored, solved

jit = njit(cache=True, error_model="numpy")

START, LEAST, MOST = 1e-3, 1e-9, 1e10
"""Damping of the first step, and its limits: above the last one no step goes down (Chaperon 2002, 4.2.1)."""


@jit
def fill_step(matrix, downhill, damping, free, step):
    """Fill the solution of the normal equations with a diagonal that is larger by the damping (Marquardt 1963).

    Parameters (p,) that are not free, and those on which nothing depends, get a step of 0. Return whether there is one.
    """
    p = len(step)
    unit, scale = np.zeros((p, p)), np.zeros(p)
    for k in range(p):
        scale[k] = 1.0 / math.sqrt(matrix[k, k]) if free[k] and matrix[k, k] > 0.0 else 0.0
        step[k] = downhill[k] * scale[k]
        unit[k, k] = 1.0 + damping
        for j in range(k):
            unit[k, j] = matrix[k, j] * scale[k] * scale[j]
    if factored(unit, step, p, np.zeros(p)) < p:
        return False
    solved(unit, step, p, step)
    for k in range(p):
        step[k] *= scale[k]
    return True


@jit
def descend(surface, moves, given, free, iterations, least):
    """Return where damped Gauss-Newton steps from a surface lead, as those of `solver` do.

    `given` are points, weights and the scale of the loss, as of `normal_equations`, and `least` the share of the cost,
    and the cost, that a last step promises to take off.
    """
    points, weights, loss_scale = given
    p = len(free)
    matrix, downhill, step = np.zeros((p, p)), np.zeros(p), np.zeros(p)
    cost = normal_equations(surface, moves, points, weights, loss_scale, matrix, downhill)
    damping = START
    for _ in range(iterations):
        if damping > MOST:
            break
        if fill_step(matrix, downhill, damping, free, step):
            if np.dot(step, downhill) <= least[0] * cost + least[1]:
                break
            there = moved(surface, moves, step)
            if possible(there.kind, there.shape):
                next_matrix, next_downhill = np.zeros((p, p)), np.zeros(p)
                trial = normal_equations(there, moves, points, weights, loss_scale, next_matrix, next_downhill)
                if trial < cost:
                    surface, matrix, downhill, cost = there, next_matrix, next_downhill, trial
                    damping = max(damping / 10.0, LEAST)
                    continue
        damping *= 10.0
    return surface
