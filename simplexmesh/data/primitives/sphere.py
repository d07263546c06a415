"""Spheres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.data.primitives import _kernels_profiles
from simplexmesh.data.primitives.base import Primitive
from simplexmesh.data.primitives.fits import Fit

UP = checks.frozen([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False, repr=False)
class Sphere(Primitive):
    """A sphere; its surface coordinates are longitude and latitude about the z axis.

    Attributes
    ----------
    center : (3,) array of float
        Center.
    radius : float
        Radius, above 0.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.primitives.Sphere([0, 0, 0], 2).distance([[3, 0, 0], [0, 0, 0]])
    array([ 1., -2.])
    """

    kind: ClassVar[str] = "sphere"
    _code: ClassVar[int] = _kernels_profiles.SPHERE
    parameter_names: ClassVar[tuple[str, ...]] = ("x", "y", "z", "radius")
    _moves: ClassVar[tuple[int, ...]] = (2, 3, 4)

    center: Array
    radius: float
    fit: Fit | None = None

    @property
    def _pose(self) -> tuple[Array, Array]:
        return self.center, UP

    @property
    def _shape(self) -> tuple[float, ...]:
        return (self.radius,)

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, *shape)

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return np.arctan2(z, rho)

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return self.radius * np.cos(v), self.radius * np.sin(v)

    def _ends(self) -> Array:
        whole = np.array([[-np.pi, np.pi], [-np.pi / 2, np.pi / 2]])
        return self.extent if self.extent is not None else whole
