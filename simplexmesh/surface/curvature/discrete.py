"""Discrete operators (Meyer, Desbrun, Schroeder, Barr 2003; Charton 2014, 2.1.1): cotangents and the angle defect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh._check import flag
from simplexmesh.surface.curvature import _kernels_discrete as kernels
from simplexmesh.surface.curvature.ringed import ringed
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
AREAS = {"mixed": kernels.MIXED, "voronoi": kernels.VORONOI, "barycentric": kernels.BARYCENTRIC}


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, area: str, projected: bool) -> Estimates:
    """Return H from the gradient of the area and K from the angle defect; no directions.

    The normal gives H its sign only, so that its error does not matter; k1 and k2 are H +- sqrt(H^2 - K), both H
    where noise makes that root negative.

    Parameters
    ----------
    area : "mixed", "voronoi" or "barycentric"
        The cell both are divided by. Voronoi cells of obtuse triangles can vanish; mixed ones cut them at the middle
        of the long side.
    projected : bool
        H is the part of the gradient along the normal rather than its whole length.
    """
    area = _check.choice("area", area, sorted(AREAS))
    around = ringed(samples, around, "discrete")
    n = len(around)
    mean, gauss, reasons = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members, around.closed)
    kernels.discrete(*rows, samples.points, normals, AREAS[area], flag("projected", projected), mean, gauss, reasons)
    swing = np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    return Estimates(mean + swing, mean - swing, mean, gauss, reasons)
