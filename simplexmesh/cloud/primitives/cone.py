"""Cones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.primitives.base import Fit, Primitive, checked_axis, text

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Cone(Primitive):
    """A half of a circular cone (Chaperon 2002, table 4.1); points beyond its apex are as far as they are from that.

    Attributes
    ----------
    point : (3,) array of float
        The apex.
    axis : (3,) array of float
        Unit direction of the axis, from the apex into the cone.
    half_angle : float
        Angle between the axis and the surface, in radians, above 0 and below pi / 2.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> funnel = sm.primitives.Cone([0, 0, 0], [0, 0, 1], np.pi / 4)
    >>> funnel.distance([[1, 0, 1], [0, 0, -2], [0, 0, 1]]).round(3)
    array([ 0.   ,  2.   , -0.707])
    """

    kind: ClassVar[str] = "cone"
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "shift u", "half angle")
    periods: ClassVar[tuple[bool, bool]] = (True, False)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4)

    point: Array
    axis: Array
    half_angle: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", checks.frozen(checks.array("point", self.point, (3,))))
        object.__setattr__(self, "axis", checked_axis("axis", self.axis))
        angle = checks.number("half_angle", self.half_angle, 0.0, open_low=True)
        if angle >= np.pi / 2:
            raise ValueError(f"half_angle must be below pi / 2, in radians, not {angle:g}")
        object.__setattr__(self, "half_angle", angle)

    def __repr__(self) -> str:
        sizes = f"half angle {np.degrees(self.half_angle):.4g} degrees"
        return f"Cone(apex {text(self.point)}, axis {text(self.axis)}, {sizes})"

    @property
    def _pose(self) -> tuple[Array, Array]:
        return self.point, self.axis

    @property
    def _shape(self) -> tuple[float, ...]:
        return (self.half_angle,)

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, axis, *shape)

    def _scaled(self, scale: float) -> tuple[float, ...]:
        return (self.half_angle,)

    def _profile(self, rho: Array, z: Array) -> tuple[Array, Array, Array, tuple[Array, ...]]:
        cos, sin = np.cos(self.half_angle), np.sin(self.half_angle)
        far = np.hypot(rho, z)
        some = np.where(far > 0, far, 1.0)
        tip = z * cos + rho * sin <= 0
        distance = np.where(tip, far, cos * rho - sin * z)
        by_angle = np.where(tip, 0.0, -sin * rho - cos * z)
        return distance, np.where(tip, rho / some, cos), np.where(tip, z / some, -sin), (by_angle,)

    def _coordinate(self, rho: Array, z: Array) -> Array:
        cos, sin = np.cos(self.half_angle), np.sin(self.half_angle)
        along: Array = np.maximum(z * cos + rho * sin, 0.0) * cos
        return along

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return v * np.tan(self.half_angle), v
