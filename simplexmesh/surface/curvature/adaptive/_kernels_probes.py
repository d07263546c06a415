"""Probes: fits of all degrees at several radii, and the statistics that separate noise from detail."""
# mypy: allow-untyped-defs

from __future__ import annotations

import numpy as np

from simplexmesh._base._kernels_njit import FAST
from simplexmesh._base._kernels_rows import by_rows
from simplexmesh.numerics._kernels_matrices import factored, influence
from simplexmesh.surface.curvature.adaptive._kernels_balls import (
    CAPACITY,
    collected,
    gathered,
    inlined,
    jit,
    seen,
    shortened,
    unit,
)
from simplexmesh.surface.curvature.adaptive._kernels_polynomials import (
    HIGHEST,
    SINGULAR,
    affordable,
    complete,
    flattened,
    framed,
    normal_equations,
    workspace,
)


@by_rows(fastmath=FAST)
def probes(begin, end, centers, surface, out):
    """Fit polynomials of all degrees at all radii of `out`, which may be shortened, and write statistics there."""
    stamps, work, last = np.full(surface.points.shape[0], -1, np.int32), workspace(CAPACITY), out.radii.shape[1] - 1
    around = work.around
    for row in range(begin, end):
        largest = out.radii[row, last]
        count = gathered(surface, centers[row], largest, stamps, row, work.found)
        collected(work.found, count, surface, around)
        largest = shortened(largest, count)
        nx, ny, nz = unit(around[3, 0], around[4, 0], around[5, 0])
        for k in range(last + 1):
            radius = out.radii[row, k] = min(out.radii[row, k], largest)
            kept = seen(around, count, (nx, ny, nz), surface.oriented, radius, work.places)
            framed(nx, ny, nz, work.frame)
            if kept > 6 and flattened(kept, work):
                _fit(row, k, radius, kept, work, out)


@inlined
def _fit(row, k, radius, kept, work, out):
    """Fit the highest degree that the points determine, and write its statistics."""
    degree, y = affordable(kept, HIGHEST), work.y
    squares = normal_equations(degree, kept, work)
    degree = complete(factored(work.matrix, y, (degree + 1) * (degree + 2) // 2, SINGULAR))
    if degree < 2:
        return
    terms = (degree + 1) * (degree + 2) // 2
    out.degrees[row, k] = degree
    for part in range(3):
        _changes(part, degree, radius, work, out.changes[row, k], out.variances[row, k], out.increments[row, k])
    _energies(work.matrix, y, degree, out.energies[row, k], out.weights[row, k])
    for t in range(terms):
        squares -= y[t] * y[t]
    out.squares[row, k] = max(squares, 0.0)
    out.freedom[row, k] = kept - terms


@jit
def _changes(part, degree, radius, work, changes, variances, increments):
    """Add each degree's change of one part of the shape operator: H, half the difference of the diagonal, the twist."""
    y, w = work.y, work.w
    first, second = (4, 4) if part == 2 else (3, 5)
    influence(work.matrix, (degree + 1) * (degree + 2) // 2, first, second, 0.0 if part == 2 else 1.0 - 2.0 * part, w)
    for d in range(2, degree + 1):
        change = variance = 0.0
        for t in range(d * (d + 1) // 2 if d > 2 else 0, (d + 1) * (d + 2) // 2):
            change += w[t] * y[t]
            variance += w[t] * w[t]
        changes[0, d - 2] += change * change
        variances[0, d - 2] += variance
        if part == 0:
            changes[1, d - 2], variances[1, d - 2] = change * change, variance
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
