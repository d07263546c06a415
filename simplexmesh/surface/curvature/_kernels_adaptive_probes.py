"""The adaptive estimator's probes: fits of all degrees at several radii, and statistics of noise and detail."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np
from numba import prange

from simplexmesh._kernels_both import Both
from simplexmesh.surface.curvature._kernels_adaptive import affordable, workspace
from simplexmesh.surface.curvature._kernels_adaptive_balls import (
    CAPACITY,
    collected,
    gathered,
    jit,
    seen,
    shortened,
    unit,
)
from simplexmesh.surface.curvature._kernels_adaptive_jets import (
    HIGHEST,
    complete,
    factored,
    flattened,
    framed,
    influence,
    normal_equations,
)

BLOCKS = HIGHEST - 2
"""Number of the degrees 3 to 6, whose coefficients have priors."""


@jit
def _changes(matrix, y, degree, part, radius, levels, increments, w):
    """Add each degree's squared change of one part of the shape operator, and its variance, to `levels`.

    Part 0 is H, 1 half the difference of the diagonal, 2 the twist.
    """
    terms = (degree + 1) * (degree + 2) // 2
    first = 4 if part == 2 else 3
    second = 4 if part == 2 else 5
    influence(matrix, terms, first, second, 0.0 if part == 2 else 1.0 - 2.0 * part, w)
    for d in range(2, degree + 1):
        change = variance = 0.0
        for t in range(d * (d + 1) // 2 if d > 2 else 0, (d + 1) * (d + 2) // 2):
            change += w[t] * y[t]
            variance += w[t] * w[t]
        levels[0, d - 2] += change * change
        levels[1, d - 2] += variance
        if part == 0:
            levels[2, d - 2] = change * change
            levels[3, d - 2] = variance
            increments[d - 2] = change / radius


@jit
def _energies(matrix, y, degree, energies, weights):
    """Add the energy of each block of degrees 3 and up, and the weight of higher degrees' coefficients in it."""
    for d in range(3, degree + 1):
        for t in range(d * (d + 1) // 2, (d + 1) * (d + 2) // 2):
            energies[d - 3] += y[t] * y[t]
        for e in range(d, degree + 1):
            share = 1.0
            for i in range(e + 1):
                r = e * (e + 1) // 2 + i
                for t in range(d * (d + 1) // 2, min(r + 1, (d + 1) * (d + 2) // 2)):
                    entry = matrix[r, t] if t < r else 1.0 / matrix[r, r]
                    weights[d - 3, e - 3] += share * entry * entry
                share *= (e - i) / (i + 1.0)


@Both
def probes(
    centers,
    offsets,
    members,
    points,
    directions,
    oriented,
    radii,
    chunks,
    levels,
    energies,
    weights,
    residuals,
    degrees,
    increments,
):
    """Fit polynomials of all degrees at all radii, and write the statistics that separate noise from detail.

    Radii of balls with more than enough points are shortened. Per row, radius k and degree d, in units of the radius:
    `levels[row, k, 0, d - 2]` is the squared norm of the change of the shape operator by degree d, `[row, k, 1, d - 2]`
    its variance at unit noise, `[.., 2 and 3, ..]` both for H alone; `energies[row, k, d - 3]` the energy |y_d|^2 of
    the block of degree d, `weights[row, k, d - 3, e - 3]` the weight of coefficients of degree e in it;
    `residuals[row, k]` the residual sum of squares and its degrees of freedom; `increments[row, k, d - 2]` the change
    of -H by degree d, in the unit of the points.
    """
    for chunk in prange(chunks):
        stamps = np.full(points.shape[0], -1, np.int32)
        found, around, places, heights, columns, sums, matrix, vectors, frame = workspace(CAPACITY)
        u, v, z, y, x, w = heights[0], heights[1], heights[2], vectors[0], vectors[1], vectors[2]
        for row in range(chunk * centers.shape[0] // chunks, (chunk + 1) * centers.shape[0] // chunks):
            center = centers[row]
            largest = radii[row, radii.shape[1] - 1]
            count = gathered(offsets, members, points, center, largest, stamps, row, found)
            collected(found, count, points, directions, around)
            largest = shortened(largest, count)
            nx, ny, nz = unit(around[3, 0], around[4, 0], around[5, 0])
            for k in range(radii.shape[1]):
                radius = radii[row, k] = min(radii[row, k], largest)
                kept = seen(around, count, nx, ny, nz, oriented, radius, places)
                if kept < 7:
                    continue
                framed(nx, ny, nz, frame)
                if not flattened(places, kept, frame, u, v, z, matrix, y, x):
                    continue
                degree = affordable(kept, HIGHEST)
                terms = (degree + 1) * (degree + 2) // 2
                squares = normal_equations(degree, u, v, z, kept, columns, sums, matrix, y)
                degree = complete(factored(matrix, y, terms))
                if degree < 2:
                    continue
                terms = (degree + 1) * (degree + 2) // 2
                degrees[row, k] = degree
                for part in range(3):
                    _changes(matrix, y, degree, part, radius, levels[row, k], increments[row, k], w)
                _energies(matrix, y, degree, energies[row, k], weights[row, k])
                for t in range(terms):
                    squares -= y[t] * y[t]
                residuals[row, k, 0] = max(squares, 0.0)
                residuals[row, k, 1] = kept - terms
