"""ExtendedSineFitting (Charton 2014, 3.3): the normal for which normal curvatures have no first harmonic."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_extended_sine as kernels
from simplexmesh.surface.normals import quadric
from simplexmesh.surface.registry import Normals
from simplexmesh.surface.sampled_surface import SampledSurface

SOLVERS = ["newton", "ternary"]


def estimate(
    samples: SampledSurface, around: Neighborhoods, normals: Array, *, solver: str, tolerance: float, iterations: int
) -> Normals:
    """Return the normals for which normal curvatures have no first harmonic; those of "quadric" elsewhere."""
    n = len(around)
    settings = kernels.Solver(
        checks.choice("solver", solver, SOLVERS) == "newton",
        checks.number("tolerance", tolerance, 0.0, open_low=True),
        checks.integer("iterations", iterations, 1),
    )
    out, fits, reasons = np.zeros((n, 3)), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    kernels.extended_sine(around.centers, around.rows, samples.points, normals, settings, out, fits, reasons)
    if len(left := np.flatnonzero(reasons)):
        instead = quadric.estimate(samples, around.taken(left), normals[left], passes=1)
        out[left], reasons[left] = instead.normals, instead.reasons
    return Normals(out, reasons)
