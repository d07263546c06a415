"""The least-squares plane of a vertex and its neighbors (Charton 2014, 3.4-3.5; Klasing et al. 2009)."""

from __future__ import annotations

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_plane as kernels
from simplexmesh.surface.normals.orientation import oriented, outward_directions
from simplexmesh.surface.registry import Normals
from simplexmesh.surface.sampled_surface import SampledSurface

VARIANTS = ["pca", "svd4"]


def estimate(samples: SampledSurface, around: Neighborhoods, normals: Array | None, *, variant: str) -> Normals:
    """Return the normals of least-squares planes, "pca" about the mean or "svd4", the thesis's, about the origin."""
    n = len(around)
    homogeneous = checks.choice("variant", variant, VARIANTS) == "svd4"
    out, reasons = np.zeros((n, 3)), np.zeros(n, np.uint8)
    kernels.planes(around.centers, around.rows, samples.points, homogeneous, out, reasons)
    return Normals(oriented(out, outward_directions(samples, around) if normals is None else normals), reasons)
