"""Discrete operators (Meyer, Desbrun, Schroeder, Barr 2003; Charton 2014, 2.1.1): cotangents and the angle defect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh._check import flag
from simplexmesh.surface.curvature import _kernels_discrete as kernels
from simplexmesh.surface.curvature.face_cycles import face_cycles
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
AREAS = {"mixed": kernels.MIXED, "voronoi": kernels.VORONOI, "barycentric": kernels.BARYCENTRIC}


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, area: str, projected: bool) -> Estimates:
    """Return H from the area gradient and K from the angle defect; no directions.

    The normal only determines the sign of H. k1 and k2 are H +- sqrt(H^2 - K), or both H where noise makes H^2 < K.

    Parameters
    ----------
    area : "mixed", "voronoi" or "barycentric"
        The cell whose area divides both. Voronoi cells can vanish at obtuse triangles; mixed ones are bounded by the
        midpoint of the long side.
    projected : bool
        Take the component of the gradient along the normal instead of its length.
    """
    area = _check.choice("area", area, sorted(AREAS))
    around = face_cycles(samples, around, "discrete")
    n = len(around)
    mean, gauss, reasons = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members, around.closed)
    kernels.discrete(*rows, samples.points, normals, AREAS[area], flag("projected", projected), mean, gauss, reasons)
    amplitude = np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    return Estimates(mean + amplitude, mean - amplitude, mean, gauss, reasons)
