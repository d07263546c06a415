"""Circles through three points and Meusnier's theorem (Chen and Schmitt 1992; Charton 2014, 2.1.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._check import flag
from simplexmesh.surface.curvature import _kernels_chen_schmitt as kernels
from simplexmesh.surface.methods import Estimates
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def estimate(samples: Samples, around: Neighborhoods, normals: Array, *, weighted: bool, normalized: bool) -> Estimates:
    """Fit Euler's formula to the normal curvatures of as many circles as there are neighbors, the most opposed ones.

    Exact on spheres. Elsewhere the circle through two neighbors not across from each other is not the one that
    osculates a section, so that the error stays however fine the mesh.

    Parameters
    ----------
    weighted : bool
        Each circle counts by its radius, as published: near-straight ones rule the fit, and a straight one, as along
        a cylinder, brings all curvatures to zero. False: all count the same.
    normalized : bool
        How far two neighbors are across from each other is the cosine between them, not their inner product; of
        equals the first in order are taken.
    """
    n = len(around)
    k1, k2, d1, reasons = np.full(n, np.nan), np.full(n, np.nan), np.full((n, 3), np.nan), np.zeros(n, np.uint8)
    rows = (around.centers, around.offsets, around.members)
    options = flag("weighted", weighted), flag("normalized", normalized)
    kernels.chen_schmitt(*rows, samples.points, normals, *options, k1, k2, d1, reasons)
    return Estimates(k1, k2, (k1 + k2) / 2, k1 * k2, reasons, d1)
