"""Cones told by where the points are, not by an apex that may be far away or at infinity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import normalized
from simplexmesh.cloud.validation.validation import NEGLIGIBLE
from simplexmesh.data.primitives import Cone, Fit, Primitive, _kernels_profiles


@dataclass(frozen=True, eq=False, repr=False)
class Taper(Primitive):
    """A cone by a point of its axis, the radius there, and the signed angle at which that grows along the axis.

    A cylinder is one of slope 0, which is no singularity: a fit may pass it.
    """

    kind: ClassVar[str] = "taper"
    _code: ClassVar[int] = _kernels_profiles.TAPER
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "radius", "slope")
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)

    point: Array
    axis: Array
    radius: float
    slope: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        if not self._is_possible:
            raise ValueError(f"no cone has the radius {self.radius:g} and the slope {self.slope:g}")

    @classmethod
    def of(cls, cone: Cone, points: Array) -> Taper | None:
        """Return a cone by its place nearest to the middle of points (n, 3); None if that is behind the apex."""
        height = float((points.mean(axis=0) - cone.point) @ cone.axis)
        if height <= 0:
            return None
        return cls(cone.point + height * cone.axis, cone.axis, height * float(np.tan(cone.half_angle)), cone.half_angle)

    def cone(self) -> Cone:
        """Return it as a cone with an apex."""
        angle = np.copysign(max(abs(self.slope), NEGLIGIBLE), self.slope)
        axis = np.copysign(1.0, angle) * self.axis
        return Cone(self.point - self.radius / np.tan(angle) * self.axis, axis, float(abs(angle)))

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, normalized(axis), *shape)
