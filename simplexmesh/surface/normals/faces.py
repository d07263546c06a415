"""Means of face normals: plain, by area, by angle (Charton 2014, 3.1-3.3), and Max's, which is exact on spheres."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_faces as kernels
from simplexmesh.surface.registry import Normals
from simplexmesh.surface.sampled_surface import SampledSurface, wedges_between

WEIGHTINGS = {"uniform": kernels.UNIFORM, "area": kernels.AREA, "angle": kernels.ANGLE, "max": kernels.MAX}


def estimate(
    samples: SampledSurface, around: Neighborhoods, normals: Array | None = None, *, weighting: str
) -> Normals:
    """Return the weighted sum of the unit normals of the faces around each center, or between consecutive neighbors."""
    n = len(around)
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    if samples.is_connected:
        rows, wedges = around.centers, samples.wedges
    else:
        rows, wedges = np.arange(n), wedges_between(around)
    kernels.face_means(n, around.centers, rows, wedges, samples.points, WEIGHTINGS[weighting], out, reasons)
    return Normals(out, reasons)
