"""Means over the one-ring: one pass reaches one edge farther, s of them the neighborhood Q^s."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from functools import partial

from numba import prange

from simplexmesh._kernels_both import PARALLEL_FROM, Both


@partial(Both, pays_from=10 * PARALLEL_FROM)  # less than a nanosecond per vertex
def averages(values, neighbors, out):
    """Fill `out` with the mean of each vertex's value and its three neighbors': a positive kernel on Q^1."""
    for i in prange(values.shape[0]):
        out[i] = 0.25 * (values[i] + values[neighbors[i, 0]] + values[neighbors[i, 1]] + values[neighbors[i, 2]])


@Both
def moments(curvature, area, out):
    """Fill `out` with curvature times area: what to average so that the mean is one over the surface."""
    for i in prange(curvature.shape[0]):
        out[i] = curvature[i] * area[i]


@Both
def quotients(moment, area, out):
    """Fill `out` with moment over area, zero where there is no area."""
    for i in prange(moment.shape[0]):
        out[i] = moment[i] / area[i] if area[i] > 0.0 else 0.0


@Both
def angle_averages(values, neighbors, inverse_radius, out):
    """Fill `out` with the mean simplex angle of each vertex and its neighbors, each carried to the vertex's circle.

    An angle seen from a circle of radius r_j becomes, on the same sphere, one of sine sin(phi_j) r_i / r_j: equal
    circles give the plain mean, and unequal ones on one sphere agree, so that spheres rest at any sampling.
    """
    for i in prange(values.shape[0]):
        total = values[i]
        for k in range(3):
            j = neighbors[i, k]
            if inverse_radius[i] > 0.0 and inverse_radius[j] > 0.0:
                sine = math.sin(values[j]) * inverse_radius[j] / inverse_radius[i]
                angle = math.asin(min(max(sine, -1.0), 1.0))
                if abs(values[j]) > 0.5 * math.pi:
                    angle = math.copysign(math.pi, values[j]) - angle
                total += angle
            else:
                total += values[j]
        out[i] = 0.25 * total
