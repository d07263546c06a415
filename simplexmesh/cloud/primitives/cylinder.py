"""Cylinders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.primitives.base import Fit, Primitive, checked_axis, text

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Cylinder(Primitive):
    """A circular cylinder (Chaperon 2002, table 4.1).

    Attributes
    ----------
    point : (3,) array of float
        A point of the axis, from which heights count.
    axis : (3,) array of float
        Unit direction of the axis.
    radius : float
        Radius, above 0.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> pipe = sm.primitives.Cylinder([0, 0, 0], [0, 0, 2], 0.5)
    >>> pipe, pipe.distance([[3, 0, 1]]), pipe.coordinates([[0, 3, 1]]).round(2)
    (Cylinder(point (0, 0, 0), axis (0, 0, 1), radius 0.5), array([2.5]), array([[1.57, 1.  ]]))
    """

    kind: ClassVar[str] = "cylinder"
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "radius")
    periods: ClassVar[tuple[bool, bool]] = (True, False)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)

    point: Array
    axis: Array
    radius: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", checks.frozen(checks.array("point", self.point, (3,))))
        object.__setattr__(self, "axis", checked_axis("axis", self.axis))
        object.__setattr__(self, "radius", checks.number("radius", self.radius, 0.0, open_low=True))

    def __repr__(self) -> str:
        return f"Cylinder(point {text(self.point)}, axis {text(self.axis)}, radius {self.radius:.6g})"

    @property
    def _pose(self) -> tuple[Array, Array]:
        return self.point, self.axis

    @property
    def _shape(self) -> tuple[float, ...]:
        return (self.radius,)

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, axis, *shape)

    def centered(self, points: ArrayLike) -> Self:
        """Return the same cylinder with its point nearest to the middle of points (n, 3)."""
        to = checks.array("points", points, (None, 3)).mean(axis=0) - self.point
        return self._with(self.point + (to @ self.axis) * self.axis, self.axis, self.radius)

    def _profile(self, rho: Array, z: Array) -> tuple[Array, Array, Array, tuple[Array, ...]]:
        one, none = np.ones_like(rho), np.zeros_like(rho)
        return rho - self.radius, one, none, (-one,)

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return z

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return np.full_like(v, self.radius), v
