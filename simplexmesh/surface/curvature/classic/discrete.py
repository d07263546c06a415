"""Discrete operators (Meyer, Desbrun, Schroeder, Barr 2003; Charton 2014, 2.1.1): cotangents and the angle defect."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.curvature.classic import _kernels_discrete as kernels
from simplexmesh.surface.face_cycles import face_cycles
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.registry import Estimates
from simplexmesh.surface.sampled_surface import SampledSurface

AREAS = {"mixed": kernels.MIXED, "voronoi": kernels.VORONOI, "barycentric": kernels.BARYCENTRIC}


def estimate(
    samples: SampledSurface, around: Neighborhoods, normals: Array, *, area: str, projected: bool
) -> Estimates:
    """Return H from the area gradient, its sign from the normal, and K from the angle defect; no directions."""
    area = checks.choice("area", area, sorted(AREAS))
    around = face_cycles(samples, around, "discrete")
    n = len(around)
    mean, gauss, reasons = np.zeros(n), np.zeros(n), np.zeros(n, np.uint8)
    seen = around._rows, samples.points, normals, AREAS[area], checks.flag("projected", projected)
    kernels.discrete(len(around.centers), around.centers, *seen, kernels.MeanAndGauss(mean, gauss), reasons)
    amplitude = np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    return Estimates(mean + amplitude, mean - amplitude, mean, gauss, reasons)
