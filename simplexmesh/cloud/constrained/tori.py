"""Tori bound to the pipes that they join: bends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, norm, normalized
from simplexmesh.cloud.constrained.base import Constrained
from simplexmesh.data.primitives import Cylinder, Torus
from simplexmesh.numerics.round_fits import between_axes


@dataclass(frozen=True, eq=False)
class TorusAfterCylinder(Constrained):
    """A bend that goes on tangentially from a cylinder with its radius: only its center is free (A.2.5, erratum 10)."""

    previous: Cylinder
    center: Array

    @property
    def primitive(self) -> Torus:  # type: ignore[override]
        """The torus."""
        moment = cross(self.previous.point - self.center, self.previous.axis)
        return Torus(self.center, moment, float(norm(moment)), self.previous.radius)

    @property
    def chart(self) -> Array:
        """(7, 3): by the center: the torus' axis turns, and its radius is the distance from the cylinder's axis."""
        torus, u0, out = self.primitive, self.previous.axis, np.zeros((7, 3))
        by_center = np.stack([cross(u0, e) for e in np.eye(3)], axis=1)
        out[:2] = torus.frame[:2] @ by_center / torus.radius
        out[2:5] = torus.frame
        out[5] = torus.axis @ by_center
        return out

    def stepped(self, step: Array) -> TorusAfterCylinder:
        """Return it with its center moved."""
        return replace(self, center=self.center + step)


@dataclass(frozen=True, eq=False)
class TorusBetweenCylinders(Constrained):
    """A bend tangent to two cylinders of one radius whose axes meet: only its radius is free (A.2.6, erratum 11)."""

    previous: Cylinder
    following: Cylinder
    radius: float

    @property
    def _bisector(self) -> tuple[Array, Array]:
        """Return where the axes meet, and how the center moves with the radius."""
        u, v = self.previous.axis, self.following.axis
        sine = float(norm(cross(u, v)))
        if sine < 1e-9:
            raise ValueError("the axes of the cylinders must meet, and these are parallel")
        ahead, _, apart, across = between_axes(self.previous.point, u, self.following.point, v)
        return self.previous.point + ahead * u + 0.5 * apart * across, (v - u) / sine

    @property
    def primitive(self) -> Torus:  # type: ignore[override]
        """The torus."""
        corner, inward = self._bisector
        axis = normalized(cross(self.previous.axis, self.following.axis))
        return Torus(corner + self.radius * inward, axis, self.radius, self.previous.radius)

    @property
    def chart(self) -> Array:
        """(7, 1): by the radius, with which the center moves along the bisector."""
        shift = self.primitive.frame @ self._bisector[1]
        return np.array([0.0, 0.0, *shift, 1.0, 0.0])[:, None]

    def stepped(self, step: Array) -> TorusBetweenCylinders:
        """Return it with another radius."""
        return replace(self, radius=self.radius + float(step[0]))
