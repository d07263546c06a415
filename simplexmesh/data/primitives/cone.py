"""Cones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.data.primitives import _kernels_profiles
from simplexmesh.data.primitives.base import Primitive
from simplexmesh.data.primitives.fits import Fit


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
    _code: ClassVar[int] = _kernels_profiles.CONE
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "shift u", "half angle")

    point: Array
    axis: Array
    half_angle: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self._is_possible:
            raise ValueError(f"half_angle must be below pi / 2, in radians, not {self.half_angle:g}")

    def _scaled(self, scale: float) -> tuple[float, ...]:
        return (self.half_angle,)

    def _coordinate(self, rho: Array, z: Array) -> Array:
        cos, sin = np.cos(self.half_angle), np.sin(self.half_angle)
        along: Array = np.maximum(z * cos + rho * sin, 0.0) * cos
        return along

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return v * np.tan(self.half_angle), v
