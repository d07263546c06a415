"""Cylinders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.data.primitives import _kernels_profiles
from simplexmesh.data.primitives.base import Primitive
from simplexmesh.data.primitives.fits import Fit


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
    _code: ClassVar[int] = _kernels_profiles.CYLINDER
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "radius")
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)

    point: Array
    axis: Array
    radius: float
    fit: Fit | None = None

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return z

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return np.full_like(v, self.radius), v
