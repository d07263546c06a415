"""Taubin's tensor (Taubin 1995; Charton 2014, 2.1.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.curvature import _kernels_taubin as kernels
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array) -> Estimates:
    """Return k1 = 3 m11 - m22 and k2 = 3 m22 - m11 from the eigenvalues of M = sum w_i k_i T_i T_i^t.

    The weights are the areas of the two faces at each edge over their sum, or equal where neighbors are not the cycle
    around an inner vertex (a border, two rings, a cloud). Exact only for weighted directions distributed as evenly as
    on a circle; on a sphere H is exact, K is not.
    """
    n = len(around)
    k1, k2, d1, reasons = np.full(n, np.nan), np.full(n, np.nan), np.full((n, 3), np.nan), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members, around.closed)
    kernels.taubin(*rows, samples.points, normals, k1, k2, d1, reasons)
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1)
