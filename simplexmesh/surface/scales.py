"""How large a detail is, and how uncertain a measured field: defaults that come from the surface itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.surface.averages import Averages
from simplexmesh.surface.bare import tell_of_bare_faces
from simplexmesh.surface.curvature.estimate import curvature
from simplexmesh.surface.curvature.result import Curvature
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]

SMALLEST = 0.006
"""Smallest window, as a share of the bounding box's diagonal (Lee, Varshney and Jacobs 2005: 2 x 0.3 %)."""

EDGES = 1.5
"""A window is never smaller than so many edges: less would average nothing."""

WIDE, SHOWS = 3.0, 3.0
"""Differences to neighbors are looked at over so many edges; an error shows in them, by a third at least."""

ALIKE = 0.25
"""Estimates from neighborhoods of a radius err alike within so much of it, measured on noisy spheres and tori."""

SPREAD = 1.4826
"""Standard deviation of a normal distribution in units of its median absolute deviation."""


def smallest_scale(averages: Averages) -> float:
    """Return the width of the smallest window that makes sense on a surface, in its unit of length.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.surface.samples import as_samples
    >>> averages = Averages(as_samples(sm.sphere(16).triangulated("dual")))
    >>> round(smallest_scale(averages) / averages.spacing, 3)
    1.5
    """
    return max(SMALLEST * averages.diagonal, EDGES * averages.spacing)


def known_or_not(name: str, values: ArrayLike, count: int) -> Array:
    """Return a caller's numbers as (count,) floats, NaN where unknown.

    Raises
    ------
    TypeError, ValueError
        They are no numbers, or of another shape.

    Examples
    --------
    >>> known_or_not("of", [1, np.nan], 2).tolist()
    [1.0, nan]
    >>> known_or_not("of", [1, 2, 3], 2)
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
    """Return the curvature the caller has already, or measure it.

    Raises
    ------
    TypeError
        What was given is no curvature.
    ValueError
        It belongs to another surface.

    Warns
    -----
    SimplexMeshWarning
        Most of the surface has no vertices that could tell of it.
    """
    tell_of_bare_faces(samples)
    if given is None:
        return curvature(samples)
    if not isinstance(given, Curvature):
        raise TypeError(f"curvature must be a Curvature, made by simplexmesh.curvature, not {type(given).__name__}")
    if len(given.k1) != len(samples.points):
        raise ValueError(f"curvature must have {len(samples.points):,} rows, one a vertex, not {len(given.k1):,}")
    return given


def unevenness(averages: Averages, values: Array) -> float:
    """Return the standard deviation of what a field has on top of its mean over the nearest vertices: its noise.

    From the median, so that edges and corners, which are few, do not count as noise.
    """
    lack = values - averages.over(values, EDGES * averages.spacing, steps=3)
    known = lack[np.isfinite(lack)]
    return SPREAD * float(np.median(np.abs(known))) if len(known) else 0.0


def local_noise(averages: Averages, known: Curvature) -> Array:
    """Return the standard deviation of H's error at each vertex, (n,): what the method told, as far as it shows.

    Neighbors that have errors of their own differ: where they do so by a third of the error told, or less, three times
    their difference is taken. Without an error, the unevenness of the whole.
    """
    if known.error is None:
        return np.full(len(known.mean), unevenness(averages, known.mean))
    lack = known.mean - averages.over(known.mean, EDGES * averages.spacing, steps=3)
    around = averages.over(lack**2, WIDE * averages.spacing, steps=1)
    shown = np.sqrt(np.maximum(around, 0.0))
    return np.minimum(np.where(np.isfinite(known.error), known.error, shown), SHOWS * shown)


def left_of_noise(averages: Averages, known: Curvature, scale: float) -> Array:
    """Return which share of the error's deviation remains in means over windows of the width `scale`, (n,), at most 1.

    A Gaussian window holds 4 pi scale^2 of area. Where vertices err each for itself, one in so many is left of a
    variance; where estimates see far, those err alike whose neighborhoods are much the same.
    """
    each = float(np.median(averages.areas)) if len(averages.areas) else 0.0
    alike = np.full(len(known.mean), each)
    if known.scale is not None:
        alike = np.maximum(alike, np.pi * (ALIKE * np.nan_to_num(known.scale)) ** 2)
    held = alike + 4 * np.pi * scale**2
    return np.sqrt(np.divide(alike, held, out=np.ones(len(alike)), where=held > 0))
