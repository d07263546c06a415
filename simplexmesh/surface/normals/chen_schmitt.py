"""Normals from the tangents of circles through opposite neighbors (Chen, Schmitt 1992; Charton 2014, 3.11-3.13)."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.checks import flag
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import _kernels_chen_schmitt as kernels
from simplexmesh.surface.registry import Normals
from simplexmesh.surface.sampled_surface import SampledSurface


def estimate(samples: SampledSurface, around: Neighborhoods, normals: Array, *, normalized: bool) -> Normals:
    """Return the sum of the cross products of the tangents of circles, on the side of the given normals."""
    out, reasons = np.zeros((len(around), 3)), np.zeros(len(around), np.uint8)
    seen = around.rows, samples.points, normals, flag("normalized", normalized)
    kernels.chen_schmitt(around.centers, *seen, out, reasons)
    return Normals(out, reasons)
