"""Cones whose axis leaves the middles of their circles: what eccentric reducers are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.data.primitives.cone import Cone


@dataclass(frozen=True, eq=False, repr=False)
class ObliqueCone(Cone):
    """A cone sheared across its axis: its circles stay at right angles to that, and their middles lean away from it.

    Distances are of first order, exact on the surface; samples are as dense as those of the cone. It is fitted as part
    of a line of pipe only.

    Attributes
    ----------
    point, axis, half_angle
        As those of the cone.
    lean : (3,) array of float
        From the axis to the middle of the circle at height 1 over the apex.

    Examples
    --------
    >>> from simplexmesh.data.primitives.oblique_cone import ObliqueCone
    >>> flush = ObliqueCone([0, 0, 0], [0, 0, 1], 0.5, lean=[0.25, 0, 0])
    >>> flush.at([[0, 2.0]]).round(3) + 0
    array([[1.593, 0.   , 2.   ]])
    """

    kind: ClassVar[str] = "oblique cone"

    lean: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        super().__post_init__()
        lean = checks.array("lean", self.lean, (3,))
        object.__setattr__(self, "lean", checks.frozen(lean - (lean @ self.axis) * self.axis))

    @classmethod
    def _names(cls) -> tuple[str, ...]:  # type: ignore[override]
        return Cone._names()

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return replace(self, point=origin, axis=axis, half_angle=shape[0], fit=None)

    @property
    def _surface(self) -> Any:
        raise TypeError("an oblique cone has no derivatives of its own: it is fitted with its line of pipe")

    def as_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain lists and numbers, angles in radians."""
        return super().as_dict() | {"lean": self.lean.tolist()}

    def measured(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return distances (n,) and gradients (n, 3) of points (n, 3) at once, to first order in the distance."""
        x, y, z = self._local(points).T
        rho, slope = np.hypot(x, y), np.tan(self.half_angle)
        out = np.stack([x, y], axis=1) @ self.frame[:2] / np.maximum(rho, 1e-300)[:, None]
        gradient = out - (slope + out @ self.lean)[:, None] * self.axis
        steep = norm(gradient)
        return (rho - slope * z) / steep, gradient / steep[:, None]

    def at(self, coordinates: ArrayLike) -> Array:
        """Return the points (n, 3) of surface coordinates (n, 2)."""
        at = checks.array("coordinates", coordinates, (None, 2))
        out: Array = super().at(at) + at[:, 1:] * self.lean
        return out

    def transformed(self, T_target_source: ArrayLike) -> Self:
        """Return it in the target frame of a similarity (4, 4), without its fit."""
        linear = checks.affine("T_target_source", T_target_source)[:3, :3]
        moved = super().transformed(T_target_source)
        return replace(moved, lean=linear @ self.lean / np.cbrt(abs(np.linalg.det(linear))))

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return z

    def _local(self, points: ArrayLike) -> Array:
        local = super()._local(points)
        out: Array = local - local[:, 2:] * (self.frame @ self.lean)
        return out
