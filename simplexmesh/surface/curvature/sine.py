"""SineFitting (Charton, Gueorguieva, Desbarats 2013; Charton 2014, 2.3): Euler's formula as a regression."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._check import flag
from simplexmesh.surface.curvature import _kernels_sine as kernels
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, least_swing: bool) -> Estimates:
    """Fit k(alpha) = H + A cos 2 (alpha - alpha_1) to the circles through each neighbor tangent to the surface.

    Exact on spheres for any neighbors, with an exact normal. Needs three directions distinct modulo pi. Four neighbors
    in a cross have two, which determine H but not K: such a vertex fails.

    Parameters
    ----------
    least_swing : bool
        Where there are two directions, return the solution of least k1 - k2 instead of failing. H is as good as ever
        if they are at right angles; K, k1, k2 and the direction are bounds, not estimates.
    """
    n = len(around)
    k1, k2, d1 = np.full(n, np.nan), np.full(n, np.nan), np.full((n, 3), np.nan)
    reasons = np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members)
    kernels.sine(*rows, samples.points, normals, flag("least_swing", least_swing), k1, k2, d1, reasons)
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1)
