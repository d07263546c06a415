"""The estimators from the neighbors in the frame of a normal; docs/curvature.md says what each is good for.

Sine: Charton, Gueorguieva, Desbarats 2013 (Charton 2014, 2.3). Quadratures: Taubin 1995; Langer, Belyaev, Seidel 2007
(2.1.3). Quadrics: McIvor, Valkenburg 1997 (2.1.2). Circles: Chen, Schmitt 1992 (2.1.4).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.curvature.classic import _kernels_fans as kernels
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.registry import Estimates
from simplexmesh.surface.sampled_surface import SampledSurface


def estimate(samples: SampledSurface, around: Neighborhoods, normals: Array, *, kind: str, **options: Any) -> Estimates:
    """Return the curvatures of an estimator of `ESTIMATORS`; `options` are those of its registry entry."""
    for name in ("least_swing", "weighted", "normalized"):
        if name in options:
            checks.flag(name, options[name])
    if "least" in options:
        options["least"] = checks.integer("least", options["least"], options["terms"])
    choice = kernels.Choice(kernels.ESTIMATORS.index(kind), **options)
    n = len(around)
    out = kernels.Curvatures(np.zeros(n), np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n, np.uint8))
    kernels.curvatures(n, around.centers, around._rows, samples.points, normals, choice, out)
    return Estimates(out.k1, out.k2, (out.k1 + out.k2) / 2, out.k1 * out.k2, out.reasons, out.d1, out.normals)
