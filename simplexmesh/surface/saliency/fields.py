"""Fields on a surface: given by callers, checked, or curvatures, measured where they are not given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.surface.curvature.estimate import curvature
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.saliency.unsampled_faces import warn_of_unsampled_faces
from simplexmesh.surface.sampled_surface import SampledSurface


def field_values(name: str, values: ArrayLike, count: int) -> Array:
    """Return a caller's field as (count,) floats, NaN where unknown."""
    given = checks.any_array(name, values)
    if given.dtype.kind not in "biuf":
        raise TypeError(f"{name} must be numbers, not {given.dtype}")
    if given.shape != (count,):
        raise ValueError(f"{name} must have shape ({count},), not {given.shape}")
    return given.astype(float)


def known_curvature(samples: SampledSurface, given: Any) -> Curvature:
    """Return the curvature the caller has given, or measure it."""
    warn_of_unsampled_faces(samples)
    if given is None:
        return curvature(samples)
    if not isinstance(given, Curvature):
        raise TypeError(f"curvature must be a Curvature, made by simplexmesh.curvature, not {type(given).__name__}")
    if len(given.k1) != len(samples.points):
        raise ValueError(f"curvature must have {len(samples.points):,} rows, one per vertex, not {len(given.k1):,}")
    return given


def field_of(of: str | ArrayLike, samples: SampledSurface, curvature: Curvature | None) -> Array:
    """Return a field by name, or given values, (n,), NaN where unknown."""
    if not isinstance(of, str):
        return field_values("of", of, len(samples.points))
    checks.choice("of", of, ("mean", "magnitude", "curvedness"))
    known = known_curvature(samples, curvature)
    field = {"mean": known.mean, "magnitude": np.abs(known.mean), "curvedness": known.curvedness}[of]
    mean_edge = np.bincount(*samples.ring_edges, len(field)) / np.maximum(samples.one_ring.valence, 1)
    bound = np.divide(1.0, mean_edge, out=np.full(len(field), np.inf), where=mean_edge > 0)  # what the mesh resolves
    return np.asarray(np.clip(field, -bound, bound))
