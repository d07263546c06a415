"""Circles through three points and Meusnier's theorem (Chen and Schmitt 1992; Charton 2014, 2.1.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._check import flag
from simplexmesh.surface.curvature import _kernels_chen_schmitt as kernels
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, weighted: bool, normalized: bool) -> Estimates:
    """Fit Euler's formula to the normal curvatures of circles through the most opposite pairs of neighbors.

    There are as many circles as neighbors. Exact on spheres; elsewhere the circle through two neighbors that are not
    opposite does not osculate a normal section, and the error does not converge to zero.

    Parameters
    ----------
    weighted : bool
        Weight each circle by its radius, as published: nearly straight ones dominate the fit, and a straight one, as
        along a cylinder, makes all curvatures zero. False: equal weights.
    normalized : bool
        Measure how opposite two neighbors are by the cosine of their angle, not by their inner product; ties are
        broken by the order of the neighbors.
    """
    n = len(around)
    k1, k2, d1, reasons = np.full(n, np.nan), np.full(n, np.nan), np.full((n, 3), np.nan), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members)
    options = flag("weighted", weighted), flag("normalized", normalized)
    kernels.chen_schmitt(*rows, samples.points, normals, *options, k1, k2, d1, reasons)
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1)
