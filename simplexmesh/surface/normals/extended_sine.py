"""ExtendedSineFitting (Charton 2014, 3.3): the normal that leaves Euler's formula nothing to explain."""

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
    """Return the normals for which the sampled normal curvatures have no part that turns once around the center.

    A normal that is off by a small angle makes curvature too large on the side it leans from and too small on the
    other. Euler's formula plus d cos t + e sin t is fitted to k = 2 (P - P_i) . N / |P - P_i|^2, and N is turned until
    d and e are gone; the answer does not depend on where it began. Wants five neighbors in different directions;
    where they are not, or N finds no rest, the answer is the quadric's.

    Exact on spheres, wherever the neighbors; on other surfaces off by O(h^2).

    Solver "newton" seeks the zero of (d, e) in two unknowns, five to seven fits a vertex. "ternary" is the thesis's
    search (algorithm 4, its errata mended): tilts along (d, e), by the angle that leaves least, twenty to a hundred
    times as many fits. Both end when the normal is off by less than `tolerance` radians, as far as (d, e) tell, or
    give up after so many `iterations`.
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
