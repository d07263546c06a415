"""Planes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull, QhullError

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import normalized
from simplexmesh.data.primitives import _kernels_profiles
from simplexmesh.data.primitives.base import Primitive
from simplexmesh.data.primitives.fits import Fit

ROUNDING = 1e-12
"""Share of the greatest coordinate: a rectangle that is less wide is a line."""


@dataclass(frozen=True, eq=False, repr=False)
class Plane(Primitive):
    """A plane; its surface coordinates are lengths along the first two rows of its `frame`.

    Attributes
    ----------
    point : (3,) array of float
        A point of it, from which the coordinates count.
    normal : (3,) array of float
        Unit normal, towards where distances are positive.
    across : (3,) array of float, optional
        Unit vector in the plane along which the first coordinate counts; of a fitted one along a side of the smallest
        rectangle around its points.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.primitives.Plane([0, 0, 1], [0, 0, 2]).distance([[5, 6, 3], [0, 0, 0]])
    array([ 2., -1.])
    """

    kind: ClassVar[str] = "plane"
    _code: ClassVar[int] = _kernels_profiles.PLANE
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift u")
    periods: ClassVar[tuple[bool, bool]] = (False, False)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 4)

    point: Array
    normal: Array
    fit: Fit | None = None
    across: Array | None = None

    def aligned(self, points: Array) -> Self:
        """Return the same plane with coordinates along the sides of the smallest rectangle around points (n, 3)."""
        at = self.coordinates(points)
        try:
            hull = at[ConvexHull(at).vertices]
        except QhullError:  # they are on a line
            return self
        sides = normalized(np.diff(hull, axis=0, append=hull[:1]))
        widths = np.ptp(hull @ sides.T, axis=0)
        heights = np.ptp(hull @ np.stack([-sides[:, 1], sides[:, 0]]), axis=0)
        least = int(np.argmin(widths * heights))
        if min(widths[least], heights[least]) < ROUNDING * np.abs(points).max():  # but for rounding
            return self
        return replace(self, across=sides[least] @ self.frame[:2])

    def coordinates(self, points: ArrayLike) -> Array:
        """Return the lengths (n, 2) along the first two rows of the frame."""
        return self._local(points)[:, :2]

    def at(self, coordinates: ArrayLike) -> Array:
        """Return the points (n, 3) of such lengths (n, 2)."""
        return self.point + checks.array("coordinates", coordinates, (None, 2)) @ self.frame[:2]

    def _area_density(self, uv: Array) -> Array:
        return np.ones(len(uv))
