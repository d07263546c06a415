"""Straight lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.data.primitives import _kernels_profiles
from simplexmesh.data.primitives.curve import Curve, eased
from simplexmesh.data.primitives.fits import Fit


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
    _code: ClassVar[int] = _kernels_profiles.LINE
    parameter_names: ClassVar[tuple[str, ...]] = ("tilt v", "tilt w", "shift v", "shift w")
    _moves: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)

    point: Array
    direction: Array
    fit: Fit | None = None

    def normal_equations(
        self, points: Array, weights: Array | None = None, loss_scale: float | None = None
    ) -> tuple[Array, Array, float]:
        """Return what a step of least squares needs: as of a primitive, by both places across, which a tilt shifts."""
        x, y, z = ((points - self.point) @ self.frame.T).T
        mass, cost = eased(x**2 + y**2, weights, loss_scale)
        rows = np.column_stack([-z, -np.ones(len(points))])
        heavy = rows * mass[:, None]
        matrix: Array = np.kron(heavy.T @ rows, np.eye(2)).astype(float)
        return matrix, -(heavy.T @ np.column_stack([x, y])).ravel(), cost

    def _coordinate(self, rho: Array, z: Array) -> Array:
        return z

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        return np.zeros_like(v), v
