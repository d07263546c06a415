"""The force that attracts the boundary of a mesh to the border of open data."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.motion.model._kernels_boundary import Outlines

Array = NDArray[np.float64]

MIN_WIDTH = 3.0
"""In mean edges of the mesh: narrower holes of the data are below its resolution and attract nothing."""

MAX_SPACING = 1.5
"""In distances between neighbors along a hole: points of the border farther away belong to other holes."""


def wide_border(target: Any, edge: float) -> Array:
    """Return the points (k, 3) on the border of a target that a mesh of this mean edge resolves."""
    border = getattr(target, "border", None)
    return np.zeros((0, 3)) if border is None else np.asarray(border.wider(MIN_WIDTH * edge))


class BorderAttraction:
    """Attraction of boundary vertices to points (k, 3) on the border of the data, across their hole.

    `weight` is the fraction of the distance covered in one iteration.
    """

    def __init__(self, points: Array, weight: float) -> None:
        if len(points) > 3000:  # more take time and move nothing
            points = points[np.random.default_rng(0).choice(len(points), 3000, replace=False)]
        self.points, self.weight = points, weight
        self._tree = cKDTree(points)

    @classmethod
    def of(cls, target: Any, edge: float, weight: float) -> BorderAttraction:
        """Return the attraction of a target's border to a mesh of this mean edge; of no points without a border."""
        return cls(wide_border(target if weight else None, edge), weight)

    def displacements(self, vertices: Array, outlines: Outlines, reach: float) -> Array:
        """Return (m, 3) the displacement of each boundary vertex towards the border.

        Its goal is the mean of the border points whose nearest vertex it is, which draws vertices into corners, or the
        nearest border point where there are none. The component along the hole is dropped to keep spacing even.
        """
        positions = vertices[outlines.vertices]
        ahead, back = positions[outlines.after], positions[outlines.before]
        distance, nearest = self._tree.query(positions)
        step = self.points[nearest] - positions
        near, owner = cKDTree(positions).query(self.points)
        side = 0.5 * (norm(ahead - positions) + norm(back - positions))
        assigned = near < MAX_SPACING * side[owner]
        count = np.bincount(owner[assigned], minlength=len(positions))
        total = np.zeros_like(positions)
        np.add.at(total, owner[assigned], self.points[assigned])
        matched = count > 0
        step[matched] = total[matched] / count[matched, None] - positions[matched]
        along = normalized(ahead - back)
        step -= dot(step, along)[:, None] * along
        step[distance > reach] = 0.0
        return np.asarray(self.weight * step)
