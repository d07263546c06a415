"""Means of face normals: plain, by area, by angle (Charton 2014, 3.1-3.3), and Max's, which is exact on spheres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.surface.methods import Normals
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_faces as kernels
from simplexmesh.surface.samples import Samples, wedges_between

Array = NDArray[np.float64]
WEIGHTINGS = {"uniform": kernels.UNIFORM, "area": kernels.AREA, "angle": kernels.ANGLE, "max": kernels.MAX}


def estimate(samples: Samples, around: Neighborhoods, normals: Array | None = None, *, weighting: str) -> Normals:
    """Return the normalized weighted sum of the normals of the faces around each center.

    Faces are the triangles or, without any, those spanned by consecutive neighbors. The weights:

    - "uniform": 1, the mean of the unit normals;
    - "area": the face's area; the sum is the vector area of the polygon around the center;
    - "angle": the face's angle at the center (Thuermer, Wuethrich 1998), independent of how faces are triangulated;
    - "max": sin(angle) over the product of the two edges (N. Max, Weights for computing vertex normals from facet
      normals, 1999). Inverted at the center, a sphere through it becomes a plane and a / |a|^2 the image of neighbor
      a; this is the vector area of the inverted polygon, so a closed ring on a sphere has the sphere's normal.
    """
    n = len(around)
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    if samples.is_connected:
        rows, wedges = around.centers, samples.wedges
    else:
        rows, wedges = np.arange(n), wedges_between(around)
    kernels.face_means(around.centers, rows, *wedges, samples.points, WEIGHTINGS[weighting], out, reasons)
    return Normals(out, reasons)
