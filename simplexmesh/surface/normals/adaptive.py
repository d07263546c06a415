"""Normals of the jets fitted by the adaptive curvature estimator."""

from __future__ import annotations

from typing import Any

from simplexmesh.surface.curvature.adaptive.adaptive import jets
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.registry import Normals
from simplexmesh.surface.sampled_surface import SampledSurface


def estimate(
    samples: SampledSurface,
    around: Neighborhoods,
    normals: Any,
    *,
    noise: float | None = None,
    detail: float | None = None,
) -> Normals:
    """Return the normals of polynomials fitted at adaptive scales; options as in `curvature`."""
    found = jets(samples, around, noise=noise, detail=detail)
    return Normals(found.normals, found.reasons)
