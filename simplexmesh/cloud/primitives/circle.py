"""Circles in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.primitives.base import Fit, checked_axis, text
from simplexmesh.cloud.primitives.curve import Curve

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Circle(Curve):
    """A circle in space; distances from it are not negative.

    Attributes
    ----------
    center : (3,) array of float
        Center.
    normal : (3,) array of float
        Unit normal of its plane.
    radius : float
        Radius, above 0.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.primitives.Circle([0, 0, 0], [0, 0, 1], 2).distance([[5, 0, 4]])
    array([5.])
    """

    kind: ClassVar[str] = "circle"
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "shift u", "radius")
    periods: ClassVar[tuple[bool, bool]] = (True, False)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4)

    center: Array
    normal: Array
    radius: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", checks.frozen(checks.array("center", self.center, (3,))))
        object.__setattr__(self, "normal", checked_axis("normal", self.normal))
        object.__setattr__(self, "radius", checks.number("radius", self.radius, 0.0, open_low=True))

    def __repr__(self) -> str:
        return f"Circle(center {text(self.center)}, normal {text(self.normal)}, radius {self.radius:.6g})"

    @property
    def _pose(self) -> tuple[Array, Array]:
        return self.center, self.normal

    @property
    def _shape(self) -> tuple[float, ...]:
        return (self.radius,)

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, axis, *shape)

    def _profile(self, rho: Array, z: Array) -> tuple[Array, Array, Array, tuple[Array, ...]]:
        out = rho - self.radius
        far = np.hypot(out, z)
        some = np.where(far > 0, far, 1.0)
        return far, out / some, z / some, (-out / some,)

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return np.zeros_like(rho)

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return np.full_like(v, self.radius), np.zeros_like(v)
