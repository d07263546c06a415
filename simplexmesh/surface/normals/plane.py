"""The plane that lies closest to a vertex and its neighbors (Charton 2014, 3.4-3.5; Klasing et al. 2009)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.surface.methods import Normals
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_plane as kernels
from simplexmesh.surface.normals.outward import outward, turned
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
VARIANTS = ["pca", "svd4"]


def estimate(samples: Samples, around: Neighborhoods, normals: Array | None, *, variant: str) -> Normals:
    """Return the normal of the least-squares plane through each center and its neighbors, at least two.

    The normals given say to which side it looks; without any, see `outward`: on a bare cloud the side is a guess.
    Variant "pca" measures from the mean of the points. "svd4" is the thesis's: the right singular vector of the rows
    (x, y, z, 1) for the smallest singular value, which depends on where the origin and what the unit is.
    """
    n = len(around)
    homogeneous = _check.choice("variant", variant, VARIANTS) == "svd4"
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    kernels.planes(around.centers, around.offsets, around.members, samples.points, homogeneous, out, reasons)
    return Normals(turned(out, outward(samples, around) if normals is None else normals), reasons)
