"""Constraints on the motion of one part in contact with another."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.numerics.rigid import point_pairs


class ContactLimits(NamedTuple):
    """Constraints on a motion."""

    tolerance: float  # gap up to which parts touch
    reach: float  # gap beyond which they do not interact
    penetration: float  # maximum depth
    moving_points: Array  # (k, 3)
    fixed_points: Array  # (k, 3) those that correspond
    slack: float  # maximum distance of corresponding points

    def pair_distances(self, T: Array) -> Array:
        """Return the distances (k,) of the pairs after the motion T (4, 4) of the moving part."""
        return np.asarray(norm(self.moving_points @ T[:3, :3].T + T[:3, 3] - self.fixed_points))


def pair_limits(pairs: Any, slack: float | None) -> tuple[Array, Array, float]:
    """Return corresponding points of the moving and the fixed part, and their maximum distance."""
    none = np.zeros((0, 3))
    if pairs is None:
        if slack is not None:
            raise ValueError("slack must be left out without pairs")
        return none, none, np.inf
    moving_points, fixed_points = point_pairs(pairs, "of the source and of the target")
    if len(moving_points) < 3 and slack is None:
        raise ValueError(f"pairs must be at least 3 without a slack, not {len(moving_points)}")
    return moving_points, fixed_points, np.inf if slack is None else checks.number("slack", slack, 0.0, open_low=True)
