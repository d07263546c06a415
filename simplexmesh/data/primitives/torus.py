"""Tori."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.data.primitives import _kernels_profiles
from simplexmesh.data.primitives.base import Primitive
from simplexmesh.data.primitives.fits import Fit


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
    _code: ClassVar[int] = _kernels_profiles.TORUS
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "shift u", "radius", "tube")
    periods: ClassVar[tuple[bool, bool]] = (True, True)

    center: Array
    axis: Array
    radius: float
    tube_radius: float
    fit: Fit | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self._is_possible:
            raise ValueError(f"tube_radius must be at most the radius, {self.radius:g}, not {self.tube_radius:g}")

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return np.arctan2(z, rho - self.radius)

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return self.radius + self.tube_radius * np.cos(v), self.tube_radius * np.sin(v)
