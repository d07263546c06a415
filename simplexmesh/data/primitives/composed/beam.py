"""Beams of I and H section."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot
from simplexmesh.data.primitives.composed.composed import Composed
from simplexmesh.data.primitives.fits import Fit
from simplexmesh.data.triangles import TriangleMesh


def _table() -> Array:
    """Return the corners (13, 2, 4) of the section, counter-clockwise from the lower right one."""
    wide, web, outer, inner = (0, 0.5, 0, 0), (0, 0, 0, 0.5), (0.5, 0, 0, 0), (0.5, 0, -1, 0)
    quarter = np.array([(wide, outer), (wide, inner), (web, inner)], float)
    upper = np.concatenate([quarter[::-1], quarter * [[-1], [1]]])
    out = np.concatenate([quarter * [[1], [-1]], upper, quarter[::-1] * -1])
    return checks.frozen(np.concatenate([out, out[:1]]))


@dataclass(frozen=True, eq=False, repr=False)
class Beam(Composed):
    """A beam of I or H section, without the roundings of its inner corners; distances are negative in its steel.

    Its surface coordinates are the length along the axis and that around the section.

    Attributes
    ----------
    point, axis : (3,) array of float
        A point of the middle line, and its unit direction.
    depth : float
        From the outer side of one flange to that of the other.
    width : float
        Of the flanges.
    flange_thickness, web_thickness : float
        Of a flange, less than half the depth, and of the web between them, less than the width.
    across : (3,) array of float, optional
        Unit direction of the width, across the axis.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> beam = sm.primitives.Beam([0, 0, 0], [0, 0, 1], 0.2, 0.1, 0.01, 0.006, across=[1, 0, 0])
    >>> beam.distance([[0, 0.15, 7], [0.013, 0, 0]]).round(6)
    array([0.05, 0.01])
    """

    kind: ClassVar[str] = "beam"
    parameter_names: ClassVar[tuple[str, ...]] = (
        *("tilt v", "tilt w", "shift v", "shift w", "turn"),
        *("depth", "width", "flange thickness", "web thickness"),
    )
    periods: ClassVar[tuple[bool, bool]] = (False, False)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3, 5)
    _table: ClassVar[Array] = _table()

    point: Array
    axis: Array
    depth: float
    width: float
    flange_thickness: float
    web_thickness: float
    fit: Fit | None = None
    across: Array | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 2 * self.flange_thickness < self.depth:
            half = self.depth / 2
            raise ValueError(f"flange_thickness must be below half the depth, {half:g}, not {self.flange_thickness:g}")
        if not self.web_thickness < self.width:
            raise ValueError(f"web_thickness must be below the width, {self.width:g}, not {self.web_thickness:g}")
        if self.across is None:
            object.__setattr__(self, "across", self._across()[0])

    def as_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain lists and numbers."""
        return super().as_dict() | {"across": self.frame[0].tolist()}

    def stepped(self, step: ArrayLike) -> Self:
        """Return it with its parameters moved by a step (p,): tilts, shifts, a turn about the axis, measures."""
        turn = float(np.asarray(step)[4])
        return replace(super().stepped(step), across=self.frame[0] + turn * self.frame[1])

    def coordinates(self, points: ArrayLike) -> Array:
        """Return the lengths (n, 2) of the nearest points along the axis, and around the section."""
        x, y, z = self._local(points).T
        return np.stack([z, self._coordinate(x, y)], axis=1)

    def at(self, coordinates: ArrayLike) -> Array:
        """Return the points (n, 3) of such lengths (n, 2)."""
        z, v = checks.array("coordinates", coordinates, (None, 2)).T
        return self.point + np.column_stack([*self._on_profile(v), z]) @ self.frame

    def triangulated(self, edge: float | None = None) -> TriangleMesh:
        """Return the part within the extent in triangles with edges of about a length."""
        found = super().triangulated(edge)
        return TriangleMesh(found.vertices, found.faces[:, ::-1])  # as across and around are to the left

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        turned = abs(dot(self.frame[0], axis)) >= abs(dot(self.axis, axis))  # its width is told later
        return cast(Any, type(self))(origin, axis, *shape, across=None if turned else self.across)

    def _flat(self, local: Array) -> Array:
        return local[:, :2]

    def _lifted(self, local: Array, gradient: Array) -> Array:
        return np.column_stack([gradient, np.zeros(len(gradient))])

    def _area_density(self, uv: Array) -> Array:
        return np.ones(len(uv))
