"""Per-vertex fields given by callers, checked, or measured where they are not given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface.curvature.estimate import curvature
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.samples import Samples
from simplexmesh.surface.unsampled_faces import warn_of_unsampled_faces

Array = NDArray[np.float64]


def field_values(name: str, values: ArrayLike, count: int) -> Array:
    """Return a caller's field as (count,) floats, NaN where unknown.

    Raises
    ------
    TypeError, ValueError
        Not numbers, or of another shape.

    Examples
    --------
    >>> field_values("of", [1, np.nan], 2).tolist()
    [1.0, nan]
    >>> field_values("of", [1, 2, 3], 2)
    Traceback (most recent call last):
    ...
    ValueError: of must have shape (2,), not (3,)
    """
    given = _check.any_array(name, values)
    if given.dtype.kind not in "biuf":
        raise TypeError(f"{name} must be numbers, not {given.dtype}")
    if given.shape != (count,):
        raise ValueError(f"{name} must have shape ({count},), not {given.shape}")
    return given.astype(float)


def known_curvature(samples: Samples, given: Any) -> Curvature:
    """Return the curvature the caller has given, or measure it.

    Raises
    ------
    TypeError
        What was given is not a `Curvature`.
    ValueError
        It has another number of rows than the surface has vertices.

    Warns
    -----
    SimplexMeshWarning
        Most of the surface consists of flat faces without interior vertices.
    """
    warn_of_unsampled_faces(samples)
    if given is None:
        return curvature(samples)
    if not isinstance(given, Curvature):
        raise TypeError(f"curvature must be a Curvature, made by simplexmesh.curvature, not {type(given).__name__}")
    if len(given.k1) != len(samples.points):
        raise ValueError(f"curvature must have {len(samples.points):,} rows, one per vertex, not {len(given.k1):,}")
    return given
