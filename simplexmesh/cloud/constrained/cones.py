"""Cones bound to the pipe before them: reducers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.cloud.constrained.base import Constrained
from simplexmesh.data.primitives import Cone, Cylinder


@dataclass(frozen=True, eq=False)
class CoaxialCone(Constrained):
    """A concentric reducer: a cone on the axis of the pipe before (Chaperon 2002, 4.5.4)."""

    primitive: Cone  # with the axis of `previous`, in either sense
    previous: Cylinder

    def __post_init__(self) -> None:
        _refuse_off_axis(self.primitive.point, self.previous)
        if abs(abs(self.primitive.axis @ self.previous.axis) - 1) > 1e-9:
            raise ValueError("primitive must have the direction of the previous axis")

    @property
    def chart(self) -> Array:
        """(6, 2): by the shift of the apex along the axis, and the half angle."""
        return np.eye(6)[:, 4:]

    def stepped(self, step: Array) -> CoaxialCone:
        """Return it moved along its axis, and opened."""
        return replace(self, primitive=self.primitive.stepped(np.concatenate([np.zeros(4), step])))


@dataclass(frozen=True, eq=False)
class SecantCone(Constrained):
    """A reducer whose axis meets that of the pipe before, at an angle (Chaperon 2002, 4.5.4)."""

    primitive: Cone
    previous: Cylinder
    place: Array

    def __post_init__(self) -> None:
        _refuse_off_axis(self.place, self.previous)

    @property
    def _height(self) -> float:
        """How far the meeting place is from the apex along the cone's axis."""
        return float((self.place - self.primitive.point) @ self.primitive.axis)

    @property
    def chart(self) -> Array:
        """(6, 5): by the shift of the place, two tilts about it, the shift of the apex, the half angle."""
        frame, out = self.primitive.frame, np.zeros((6, 5))
        out[2:5, 0] = frame @ self.previous.axis
        out[0, 1] = out[1, 2] = out[4, 3] = out[5, 4] = 1.0
        out[2, 1] = out[3, 2] = -self._height
        return out

    def stepped(self, step: Array) -> SecantCone:
        """Return it moved along the axis before, tilted about the place there, drawn back, and opened."""
        cone = self.primitive
        turned = cone.stepped(np.array([step[1], step[2], 0.0, 0.0, 0.0, step[4]]))
        place = self.place + step[0] * self.previous.axis
        apex = place + (step[3] - self._height) * turned.axis
        return replace(self, primitive=Cone(apex, turned.axis, turned.half_angle), place=place)


def _refuse_off_axis(place: Array, previous: Cylinder) -> None:
    """Refuse a place that is not on the axis of a cylinder."""
    away = np.asarray(place, float) - previous.point
    if norm(away - (away @ previous.axis) * previous.axis) > 1e-9 * (norm(away) + previous.radius):
        raise ValueError("the cone's place must be on the axis of the previous cylinder")
