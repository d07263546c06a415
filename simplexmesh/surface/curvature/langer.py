"""Langer's quadratures (Langer, Belyaev, Seidel 2007; Charton 2014, 2.1.3), in a tensor or exact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.curvature import _kernels_langer as kernels
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, exact: bool) -> Estimates:
    """Weight neighbors by the tangents of the angles between them in the tangent plane, in order of azimuth.

    The weights make sum w exp(2 i theta) vanish, so that H is exact for Euler's formula in any directions. In Taubin's
    tensor (`exact` False, as in the thesis) K is exact only at umbilics; `exact` takes the difference of k1 and k2 from
    a second quadrature, with sum w exp(4 i theta) = 0, or from least squares where its weights nearly cancel, as on a
    square grid with diagonals. Right angles between neighbors have infinite tangents: there the limit is taken, and
    results are discontinuous nearby. No faces are needed.
    """
    n = len(around)
    k1, k2, d1, reasons = np.full(n, np.nan), np.full(n, np.nan), np.full((n, 3), np.nan), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members)
    kernels.langer(*rows, samples.points, normals, exact, k1, k2, d1, reasons)
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1)
