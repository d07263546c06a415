"""Circles in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.data.primitives import _kernels_profiles as kernels
from simplexmesh.data.primitives.curve import Curve, eased
from simplexmesh.data.primitives.fits import Fit


@dataclass(frozen=True, eq=False, repr=False)
class Circle(Curve):
    """A circle in space, of a rim with the normal out of the surface; distances from it are not negative.

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
    _code: ClassVar[int] = kernels.CIRCLE
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w", "shift u", "radius")

    center: Array
    normal: Array
    radius: float
    fit: Fit | None = None

    @property
    def vertices(self) -> Indices | None:
        """(m,) numbers of the points that it was fitted to, if others were left out."""
        return self.fit.vertices if self.fit else None

    @property
    def covered(self) -> float | None:
        """Share of the circle that has points near, if it was fitted: half a rim has 0.5."""
        return self.fit.covered if self.fit else None

    def normal_equations(
        self, points: Array, weights: Array | None = None, loss_scale: float | None = None
    ) -> tuple[Array, Array, float]:
        """Return what a step of least squares needs: as of a primitive, by distances in its plane and from that."""
        square = self.distance(points) ** 2
        mass, cost = eased(square, weights, loss_scale)
        both = (self._surface._replace(kind=kind) for kind in (kernels.CYLINDER, kernels.PLANE))
        parts = (self._summed(each, points, mass, np.inf) for each in both)
        return *(one + other for one, other in zip(*(part[:2] for part in parts), strict=True)), cost

    def _ends(self) -> Array:
        return self.extent if self.extent is not None else np.array([[-np.pi, np.pi], [0.0, 0.0]])

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return np.zeros_like(rho)

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return np.full_like(v, self.radius), np.zeros_like(v)
