"""The least-squares plane of a vertex and its neighbors (Charton 2014, 3.4-3.5; Klasing et al. 2009)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.surface.methods import Normals
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_plane as kernels
from simplexmesh.surface.normals.orientation import oriented, outward_directions
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]
VARIANTS = ["pca", "svd4"]


def estimate(samples: Samples, around: Neighborhoods, normals: Array | None, *, variant: str) -> Normals:
    """Return the normal of the least-squares plane through each center and its neighbors, at least two.

    The given normals determine its sign; without any, `outward_directions`.
    Variant "pca" centers the points at their mean. "svd4" is the thesis's: the right singular vector of the rows
    (x, y, z, 1) for the smallest singular value, which depends on the origin and the unit.
    """
    n = len(around)
    homogeneous = _check.choice("variant", variant, VARIANTS) == "svd4"
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    kernels.planes(around.centers, around.offsets, around.members, samples.points, homogeneous, out, reasons)
    return Normals(oriented(out, outward_directions(samples, around) if normals is None else normals), reasons)
