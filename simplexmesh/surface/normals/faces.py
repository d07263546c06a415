"""Means of face normals: plain, by area, by angle (Charton 2014, 3.1-3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.methods import Normals
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_faces as kernels
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
WEIGHTINGS = {"uniform": kernels.UNIFORM, "area": kernels.AREA, "angle": kernels.ANGLE}


def estimate(samples: Samples, around: Neighborhoods, normals: None, *, weighting: str) -> Normals:
    """Return the normalized mean of the normals of the faces around each center, a fan at a border."""
    n = len(around)
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members, around.closed)
    kernels.face_means(*rows, samples.points, WEIGHTINGS[weighting], out, reasons)
    return Normals(out, reasons)
