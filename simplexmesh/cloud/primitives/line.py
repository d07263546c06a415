"""Straight lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh.cloud.primitives.base import Fit, checked_axis, text
from simplexmesh.cloud.primitives.curve import Curve

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Line(Curve):
    """A straight line; distances from it are not negative.

    Attributes
    ----------
    point : (3,) array of float
        A point of it, from which lengths count.
    direction : (3,) array of float
        Unit vector along it.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.primitives.Line([0, 0, 0], [0, 0, 1]).distance([[3, 4, 9]])
    array([5.])
    """

    kind: ClassVar[str] = "line"
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w")
    periods: ClassVar[tuple[bool, bool]] = (True, False)
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)

    point: Array
    direction: Array
    fit: Fit | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", checks.frozen(checks.array("point", self.point, (3,))))
        object.__setattr__(self, "direction", checked_axis("direction", self.direction))

    def __repr__(self) -> str:
        return f"Line(point {text(self.point)}, direction {text(self.direction)})"

    @property
    def _pose(self) -> tuple[Array, Array]:
        return self.point, self.direction

    @property
    def _shape(self) -> tuple[float, ...]:
        return ()

    def _with(self, origin: Array, axis: Array, *shape: Any) -> Self:
        return type(self)(origin, axis)

    def centered(self, points: ArrayLike) -> Self:
        """Return the same line with its point nearest to the middle of points (n, 3)."""
        to = checks.array("points", points, (None, 3)).mean(axis=0) - self.point
        return self._with(self.point + (to @ self.direction) * self.direction, self.direction)

    def _profile(self, rho: Array, z: Array) -> tuple[Array, Array, Array, tuple[Array, ...]]:
        return rho, np.ones_like(rho), np.zeros_like(rho), ()

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return z

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return np.zeros_like(v), v
