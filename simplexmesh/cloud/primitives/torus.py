"""Tori."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.primitives.base import Fit, Primitive, checked_axis, text

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Torus(Primitive):
    """A torus: what is as far as the radius of its tube from a circle (Chaperon 2002, table 4.1).

    Attributes
    ----------
    center : (3,) array of float
        Center.
    axis : (3,) array of float
        Unit direction of its axis of revolution.
    radius : float
        Radius of the circle in the middle of the tube: of a bend of a pipe, that of its center line.
    tube_radius : float
        Radius of the tube, at most the other one.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring = sm.primitives.Torus([0, 0, 0], [0, 0, 1], 3, 1)
    >>> ring.distance([[5, 0, 0], [3, 0, 0]]), ring.mesh().genus
    (array([ 1., -1.]), 1)
    """

    kind: ClassVar[str] = "torus"
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "shift u", "radius", "tube")
    periods: ClassVar[tuple[bool, bool]] = (True, True)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 4)

    center: Array
    axis: Array
    radius: float
    tube_radius: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", checks.frozen(checks.array("center", self.center, (3,))))
        object.__setattr__(self, "axis", checked_axis("axis", self.axis))
        object.__setattr__(self, "radius", checks.number("radius", self.radius, 0.0, open_low=True))
        tube = checks.number("tube_radius", self.tube_radius, 0.0, open_low=True)
        if tube > self.radius:
            raise ValueError(f"tube_radius must be at most the radius, {self.radius:g}, not {tube:g}")
        object.__setattr__(self, "tube_radius", tube)

    def __repr__(self) -> str:
        sizes = f"radius {self.radius:.6g}, tube radius {self.tube_radius:.6g}"
        return f"Torus(center {text(self.center)}, axis {text(self.axis)}, {sizes})"

    @property
    def _pose(self) -> tuple[Array, Array]:
        return self.center, self.axis

    @property
    def _shape(self) -> tuple[float, ...]:
        return self.radius, self.tube_radius

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, axis, *shape)

    def _profile(self, rho: Array, z: Array) -> tuple[Array, Array, Array, tuple[Array, ...]]:
        out = rho - self.radius
        far = np.hypot(out, z)
        some = np.where(far > 0, far, 1.0)
        return far - self.tube_radius, out / some, z / some, (-out / some, -np.ones_like(far))

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return np.arctan2(z, rho - self.radius)

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return self.radius + self.tube_radius * np.cos(v), self.tube_radius * np.sin(v)
