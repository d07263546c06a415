"""Kernels that average over the one-ring; s passes average over the neighborhood Q^s."""
# mypy: allow-untyped-defs

from __future__ import annotations

import math
from functools import partial

from numba import prange

from simplexmesh._base._kernels_both import PARALLEL_FROM, Both


@partial(Both, pays_from=10 * PARALLEL_FROM)  # less than a nanosecond per vertex
def averages(values, neighbors, out):
    """Fill `out` with the mean of each vertex's value and its three neighbors': a positive kernel on Q^1."""
    for i in prange(values.shape[0]):
        out[i] = 0.25 * (values[i] + values[neighbors[i, 0]] + values[neighbors[i, 1]] + values[neighbors[i, 2]])


@Both
def moments(curvature, area, out):
    """Fill `out` with curvature times area, whose averages over those of the area are area-weighted means."""
    for i in prange(curvature.shape[0]):
        out[i] = curvature[i] * area[i]


@Both
def quotients(moment, area, out):
    """Fill `out` with moment over area, zero where the area is zero."""
    for i in prange(moment.shape[0]):
        out[i] = moment[i] / area[i] if area[i] > 0.0 else 0.0


@Both
def angle_averages(values, neighbors, inverse_radius, out):
    """Fill `out` with the mean simplex angle over the one-ring, angles converted to the vertex's own circumradius.

    On one sphere, an angle phi_j of circumradius r_j corresponds to an angle of sine sin(phi_j) r_i / r_j.
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
