"""Planes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.primitives.base import Fit, Primitive, checked_axis, text

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Plane(Primitive):
    """A plane; its surface coordinates are lengths along the first two rows of its `frame`.

    Attributes
    ----------
    point : (3,) array of float
        A point of it, from which the coordinates count.
    normal : (3,) array of float
        Unit normal, towards where distances are positive.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.primitives.Plane([0, 0, 1], [0, 0, 2]).distance([[5, 6, 3], [0, 0, 0]])
    array([ 2., -1.])
    """

    kind: ClassVar[str] = "plane"
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift u")
    periods: ClassVar[tuple[bool, bool]] = (False, False)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 4)

    point: Array
    normal: Array
    fit: Fit | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", checks.frozen(checks.array("point", self.point, (3,))))
        object.__setattr__(self, "normal", checked_axis("normal", self.normal))

    def __repr__(self) -> str:
        return f"Plane(point {text(self.point)}, normal {text(self.normal)})"

    @property
    def _pose(self) -> tuple[Array, Array]:
        return self.point, self.normal

    @property
    def _shape(self) -> tuple[float, ...]:
        return ()

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, axis)

    def projected(self, points: ArrayLike) -> Array:
        """Return the nearest points (n, 3) of the plane."""
        return self.at(self.coordinates(points))

    def coordinates(self, points: ArrayLike) -> Array:
        """Return the lengths (n, 2) along the first two rows of the frame."""
        return self._local(points)[:, :2]

    def at(self, coordinates: ArrayLike) -> Array:
        """Return the points (n, 3) of such lengths (n, 2)."""
        return self.point + checks.array("coordinates", coordinates, (None, 2)) @ self.frame[:2]

    def centered(self, points: ArrayLike) -> Self:
        """Return the same plane with its point nearest to the middle of points (n, 3)."""
        middle = checks.array("points", points, (None, 3)).mean(axis=0)
        return self._with(middle - ((middle - self.point) @ self.normal) * self.normal, self.normal)

    def _profile(self, rho: Array, z: Array) -> tuple[Array, Array, Array, tuple[Array, ...]]:
        return z, np.zeros_like(z), np.ones_like(z), ()

    def _coordinate(self, rho: Array, z: Array) -> Array:
        raise NotImplementedError("a plane's coordinates are not those of a profile")

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        raise NotImplementedError("a plane's coordinates are not those of a profile")

    def _area_density(self, uv: Array) -> Array:
        return np.ones(len(uv))
