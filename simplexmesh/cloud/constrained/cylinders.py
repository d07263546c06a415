"""Cylinders bound to the pipe before them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, normalized
from simplexmesh.cloud.constrained.base import Constrained
from simplexmesh.data.primitives import Cylinder, Torus


@dataclass(frozen=True, eq=False)
class SecantCylinder(Constrained):
    """A cylinder whose axis meets that of the one before, at its point: a branch, or a mitre (Chaperon 2002, A.2.1)."""

    primitive: Cylinder
    previous: Cylinder
    fixed_radius: bool = False

    @classmethod
    def near(cls, free: Cylinder, previous: Cylinder, *, fixed_radius: bool = False) -> SecantCylinder:
        """Return the secant cylinder with the direction of a free one, from the point of the axis nearest to that.

        With a fixed radius it has that of the one before. Of parallel axes the point is that of the one before.
        """
        u, u0 = free.axis, previous.axis
        slant = 1 - (u @ u0) ** 2
        mu = (free.point - previous.point) @ (u0 - (u0 @ u) * u) / slant if slant > 1e-12 else 0.0
        radius = previous.radius if fixed_radius else free.radius
        return cls(Cylinder(previous.point + mu * u0, u, radius), previous, fixed_radius)

    @property
    def chart(self) -> Array:
        """(5, 3 or 4): by the shift along the axis before, two tilts and the radius."""
        frame, out = self.primitive.frame, np.zeros((5, 4))
        out[2:4, 0] = frame[:2] @ self.previous.axis
        out[0, 1] = out[1, 2] = out[4, 3] = 1.0
        return out[:, :3] if self.fixed_radius else out

    def stepped(self, step: Array) -> SecantCylinder:
        """Return it moved along the axis before, tilted, and widened."""
        wider = 0.0 if self.fixed_radius else step[3]
        moved = self.primitive.stepped(np.array([step[1], step[2], 0.0, 0.0, wider]))
        return replace(
            self, primitive=Cylinder(self.primitive.point + step[0] * self.previous.axis, moved.axis, moved.radius)
        )


@dataclass(frozen=True, eq=False)
class BallJointCylinder(Constrained):
    """A cylinder of given radius whose axis passes through its given point: only its direction is free (A.2.3)."""

    primitive: Cylinder

    @property
    def chart(self) -> Array:
        """(5, 2): by two tilts."""
        return np.eye(5)[:, :2]

    def stepped(self, step: Array) -> BallJointCylinder:
        """Return it tilted."""
        return replace(self, primitive=self.primitive.stepped(np.concatenate([step, np.zeros(3)])))


@dataclass(frozen=True, eq=False)
class CylinderAfterTorus(Constrained):
    """A cylinder that leaves a bend along its tangent after an angle about the bend's axis (A.2.4, erratum 9)."""

    torus: Torus
    turn: float

    @property
    def primitive(self) -> Cylinder:  # type: ignore[override]
        """The cylinder, from the end of the bend."""
        arm = np.cos(self.turn) * self.torus.frame[0] + np.sin(self.turn) * self.torus.frame[1]
        end = self.torus.center + self.torus.radius * arm
        return Cylinder(end, cross(self.torus.axis, arm), self.torus.tube_radius)

    @property
    def chart(self) -> Array:
        """(5, 1): by the angle; the end of the bend moves along the axis, which changes nothing."""
        cylinder = self.primitive
        arm = normalized(cylinder.point - self.torus.center)
        return np.append(-cylinder.frame[:2] @ arm, np.zeros(3))[:, None]

    def stepped(self, step: Array) -> CylinderAfterTorus:
        """Return it after another angle."""
        return replace(self, turn=self.turn + float(step[0]))
