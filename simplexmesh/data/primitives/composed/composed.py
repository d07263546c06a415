"""What composed primitives are: profiles of straight pieces whose corners are linear in a few measures."""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.data.primitives.base import Primitive
from simplexmesh.data.primitives.composed.profile import ProfileFeet, feet
from simplexmesh.data.primitives.curve import eased

NECK = 1e3
"""Of the first measure: a profile that goes on for longer has no end there."""

NEAR = 3.0
"""Deviations of the noise."""


class Composed(Primitive):
    """A profile of straight pieces, of which each is nearest in a zone (Chaperon 2002, 4.5.5).

    The second surface coordinate is the length along the profile.
    """

    _table: ClassVar[Array]
    """(m, 2, k): corners of the profile by the measures, the inside on the left; a closed one ends with the first."""

    _begin: ClassVar[int] = 0
    """The corner from which lengths count."""

    _least_slope: ClassVar[float] = 0.25
    """In an inner corner the nearest side is not the one ahead, and the distance may not change on the way to that."""

    def measured(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return distances (n,) and gradients (n, 3) of points (n, 3) at once."""
        local = self._local(points)
        found = self._feet(local)
        return found.distance, self._lifted(local, found.gradient) @ self.frame

    def within(self, points: ArrayLike) -> Array:
        """Return the ranges (2, 2) of the surface coordinates: of all the profile but necks, and of points (n, 3)."""
        out, whole = super().within(points), self._knots[[0, -1]]
        out[1] = np.where(np.abs(whole) < NECK * self._shape[0], whole, out[1])
        return out

    def derivatives(self, points: ArrayLike) -> Array:
        """Return the derivatives (n, p) of the distances of points (n, 3) by the parameters, for `stepped`."""
        return self._rows(points)[0]

    def normal_equations(
        self, points: Array, weights: Array | None = None, loss_scale: float | None = None
    ) -> tuple[Array, Array, float]:
        """Return the normal matrix (p, p), the downhill vector (p,) and the cost of distances of points (n, 3)."""
        rows, distance = self._rows(points)
        mass, cost = eased(distance**2, weights, loss_scale)
        weighted = mass[:, None] * rows
        return rows.T @ weighted, -distance @ weighted, cost

    def _rows(self, points: ArrayLike) -> tuple[Array, Array]:
        """Return derivatives (n, p) and distances (n,): feet move along their piece, but as that does not matter."""
        local = self._local(points)
        found = self._feet(local)
        x, y, z = local.T
        gx, gy, gz = self._lifted(local, found.gradient).T
        motions = np.stack([gz * x - gx * z, gz * y - gy * z, -gx, -gy, -gz, gx * y - gy * x], axis=1)
        share = found.share[:, None, None]
        moved = (1 - share) * self._table[found.piece] + share * self._table[found.piece + 1]
        by_measures = -np.einsum("ij,ijk->ik", found.gradient, moved)
        return np.column_stack([motions[:, list(self._moves)], by_measures]), found.distance

    def _telling(self, points: Array, noise: float) -> Mask:
        """Leave out points near corners: those of one side there are as near to the other one, which may be unseen."""
        found = self._feet(self._local(points))
        way = found.share * np.diff(self._knots)[found.piece]
        return np.minimum(way, np.diff(self._knots)[found.piece] - way) > NEAR * noise

    def _feet(self, local: Array) -> ProfileFeet:
        return feet(self._corners, self._flat(local))

    def _flat(self, local: Array) -> Array:
        """Return the places (n, 2) of points in the plane of the profile: distances from the axis, and along it."""
        return np.stack([np.hypot(local[:, 0], local[:, 1]), local[:, 2]], axis=1)

    def _lifted(self, local: Array, gradient: Array) -> Array:
        """Return gradients (n, 2) in the plane of the profile as those in the frame (n, 3)."""
        out = local[:, :2] / np.maximum(np.hypot(local[:, 0], local[:, 1]), 1e-300)[:, None]
        return np.column_stack([gradient[:, :1] * out, gradient[:, 1]])

    @cached_property
    def _corners(self) -> Array:
        return checks.frozen(self._table @ np.array(self._shape))

    @cached_property
    def _knots(self) -> Array:
        """The surface coordinates (m,) of the corners."""
        along = np.append(0.0, np.cumsum(norm(np.diff(self._corners, axis=0))))
        return checks.frozen(along - along[self._begin])

    def _coordinate(self, rho: Array, z: Array) -> Array:
        found = feet(self._corners, np.stack([rho, z], axis=1))
        return self._knots[found.piece] + found.share * np.diff(self._knots)[found.piece]

    def _on_profile(self, v: Array) -> tuple[Array, Array]:
        piece = np.clip(np.searchsorted(self._knots, v, side="right") - 1, 0, len(self._knots) - 2)
        share = (v - self._knots[piece]) / np.diff(self._knots)[piece]
        at = self._corners[piece] + share[:, None] * np.diff(self._corners, axis=0)[piece]
        return at[:, 0], at[:, 1]
