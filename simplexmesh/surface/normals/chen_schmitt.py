"""Normals from the tangents of circles through opposite neighbors (Chen, Schmitt 1992; Charton 2014, 3.11-3.13)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._check import flag
from simplexmesh.surface.methods import Normals
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_chen_schmitt as kernels
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, normalized: bool) -> Normals:
    """Return the normalized sum of the cross products of the tangents of circles through each center and two neighbors.

    There are as many pairs as neighbors, at least three, the most opposite first: by scalar product as printed, or by
    angle if `normalized`. Ties, which every regular ring has, are broken by the order of the neighbors, on which the
    result therefore depends. Exact on spheres. The given normals determine the sign.
    """
    n = len(around)
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members)
    kernels.chen_schmitt(*rows, samples.points, normals, flag("normalized", normalized), out, reasons)
    return Normals(out, reasons)
