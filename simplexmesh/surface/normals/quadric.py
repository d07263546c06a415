"""The least-squares quadric of a vertex's neighbors (Charton 2014, 3.6-3.10; McIvor, Valkenburg 1997)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.surface.curvature import _kernels_quadric as kernels
from simplexmesh.surface.methods import Normals
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, passes: int) -> Normals:
    """Return the normal at each center of z = a x^2 + b x y + c y^2 + d x + e y, with z along the given normal.

    Needs five neighbors that are not on one conic through the center. Exact on quadric graphs over the plane normal to
    the given normals. One pass is as published; further passes start from the fitted normal. The fit is that of the
    curvature estimator "extended_quadric", which requires six neighbors.
    """
    reasons = np.zeros(len(around), np.uint8)
    terms = kernels.EXTENDED  # also the least number of neighbors
    rows = (around.centers, around.offsets, around.members)
    for _ in range(_check.integer("passes", passes, 1)):
        shape, d1, fitted = np.empty((2, len(around))), np.empty((len(around), 3)), np.zeros((len(around), 3))
        kernels.quadric(*rows, samples.points, normals, terms, terms, *shape, d1, fitted, reasons)
        normals = fitted
    return Normals(normals, reasons)
