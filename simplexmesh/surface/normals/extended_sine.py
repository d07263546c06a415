"""ExtendedSineFitting (Charton 2014, 3.3): the normal for which normal curvatures have no first harmonic."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.surface.methods import Normals
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_extended_sine as kernels
from simplexmesh.surface.normals import quadric
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
SOLVERS = ["newton", "ternary"]


def estimate(
    samples: Samples, around: Neighborhoods, normals: Array, *, solver: str, tolerance: float, iterations: int
) -> Normals:
    """Return the normals for which the sampled normal curvatures have no first harmonic.

    A normal tilted by a small angle adds d cos t + e sin t, t the azimuth, to the normal curvatures. That and Euler's
    formula are fitted to k = 2 (P - P_i) . N / |P - P_i|^2, and N is tilted until d and e vanish; the result does not
    depend on the initial normal. Needs five neighbors in different directions; with fewer, or without convergence, the
    result is that of "quadric".

    Exact on spheres, for any neighbors; on other surfaces the error is O(h^2).

    Solver "newton" finds the root of (d, e) in two unknowns, with five to seven fits per vertex. "ternary" is the
    thesis's search (algorithm 4, errata corrected): it tilts along (d, e) by the angle that minimizes their norm, with
    twenty to a hundred times as many fits. Both stop when the error of the normal is below `tolerance` radians, as
    estimated from (d, e), or after `iterations` steps.
    """
    n = len(around)
    newton = _check.choice("solver", solver, SOLVERS) == "newton"
    limits = (_check.number("tolerance", tolerance, 0.0, open_low=True), _check.integer("iterations", iterations, 1))
    out, fits, reasons = np.zeros((n, 3)), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members)
    kernels.extended_sine(*rows, samples.points, normals, newton, *limits, out, fits, reasons)
    if len(left := np.flatnonzero(reasons)):
        instead = quadric.estimate(samples, around.taken(left), normals[left], passes=1)
        out[left], reasons[left] = instead.normals, instead.reasons
    return Normals(out, reasons)
