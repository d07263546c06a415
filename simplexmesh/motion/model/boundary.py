"""The attraction of the boundary of a mesh to the border of the data."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm, normalized, sums
from simplexmesh.motion.model._kernels_contours import Courses

MIN_WIDTH = 3.0
"""In mean edges of the mesh: narrower holes of the data are below its resolution and attract nothing."""

MAX_SPACING = 1.5
"""In distances between neighbors along a hole: points of the border farther away belong to other holes."""


def wide_border(target: Any, edge: float) -> Array:
    """Return the points (k, 3) on the border of a target that a mesh of this mean edge resolves."""
    border = getattr(target, "border", None)
    return np.zeros((0, 3)) if border is None else np.asarray(border.wider(MIN_WIDTH * edge))


class BorderAttraction:
    """Attraction of boundary vertices to points (k, 3), by a fraction `weight` of the distance in one iteration."""

    def __init__(self, points: Array, weight: float) -> None:
        if len(points) > 3000:  # more take time and move nothing
            points = points[np.random.default_rng(0).choice(len(points), 3000, replace=False)]
        self.points, self.weight = points, weight
        self._tree = cKDTree(points)

    def displacements(self, vertices: Array, rims: Courses, reach: float) -> Array:
        """Return (m, 3) the way, across its hole, of each boundary vertex to the mean of its nearest points."""
        positions = vertices[rims.vertices]
        ahead, back = positions[rims.after], positions[rims.before]
        distance, nearest = self._tree.query(positions)
        step = self.points[nearest] - positions
        near, owner = cKDTree(positions).query(self.points)  # means of what is nearest draw vertices into corners
        side = 0.5 * (norm(ahead - positions) + norm(back - positions))
        assigned = near < MAX_SPACING * side[owner]
        count = np.bincount(owner[assigned], minlength=len(positions))
        total = sums(self.points[assigned], owner[assigned], len(positions))
        matched = count > 0
        step[matched] = total[matched] / count[matched, None] - positions[matched]
        along = normalized(ahead - back)
        step -= dot(step, along)[:, None] * along  # keeps the spacing along the hole
        step[distance > reach] = 0.0
        return np.asarray(self.weight * step)
