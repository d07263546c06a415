"""The least-squares quadric of a vertex's neighbors (Charton 2014, 3.6-3.10; McIvor, Valkenburg 1997)."""

from __future__ import annotations

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.curvature.classic import fans
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.registry import Normals
from simplexmesh.surface.sampled_surface import SampledSurface


def estimate(samples: SampledSurface, around: Neighborhoods, normals: Array, *, passes: int) -> Normals:
    """Return the normal of the curvature estimator "extended_quadric", from five neighbors on."""
    for _ in range(checks.integer("passes", passes, 1)):
        found = fans.estimate(samples, around, normals, kind="quadric", terms=5, least=5)
        assert found.normals is not None
        normals = found.normals
    return Normals(normals, found.reasons)
