"""The force that attracts the rims of a mesh to the border of open data."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import dot, norm, normalized
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.rim import Rim

Array = NDArray[np.float64]

MOST_POINTS = 3000
MIN_WIDTH = 3.0
"""In mean edges of the mesh: narrower holes of the data are below its resolution and attract no rim."""
MAX_SPACING = 1.5
"""In distances between neighbors along the rim: points of the border farther away belong to other rims."""


class BorderForce:
    """Attraction of rim vertices to the border of the data, across the rim.

    Parameters
    ----------
    points : (k, 3) array of float
        On the border of the data.
    weight : float
        Fraction of the distance to the border covered in one iteration.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> flat = sm.plane(vertices=200)
    >>> square = np.linspace(-0.6, 0.6, 40)
    >>> side = np.full(40, 0.6)
    >>> border = np.concatenate([np.stack([x, y, 0 * x], 1) for x, y in ((square, side), (square, -side))])
    >>> rim = Rim.of(flat.connectivity)
    >>> BorderForce(border, 0.3).displacements(flat.vertices, rim, 1.0).shape == (len(rim.vertices), 3)
    True
    """

    def __init__(self, points: Array, weight: float) -> None:
        if len(points) > MOST_POINTS:
            points = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
        self.points, self.weight = points, weight
        self._tree = cKDTree(points)

    @classmethod
    def of(cls, target: Any, mesh: SimplexMesh, weight: float) -> BorderForce:
        """Return the force of a target's border, with no points if the target has none or the mesh no hole."""
        border = getattr(target, "border", None) if mesh.n_holes and weight else None
        if border is None:
            return cls(np.zeros((0, 3)), weight)
        ends = mesh.vertices[mesh.connectivity.edge_vertices]
        return cls(border.wider(MIN_WIDTH * float(norm(ends[:, 0] - ends[:, 1]).mean())), weight)

    def added_to(self, extra: Array | None, vertices: Array, rim: Rim, reach: float) -> Array:
        """Return displacements (n, 3): `extra`, plus those of this force at rim vertices."""
        out = np.zeros_like(vertices) if extra is None else extra.copy()
        if len(self.points):
            out[rim.vertices] += self.displacements(vertices, rim, reach)
        return out

    def displacements(self, vertices: Array, rim: Rim, reach: float) -> Array:
        """Return (m, 3) the displacement of each rim vertex towards the border.

        Its goal is the mean of the border points whose nearest rim vertex it is, which draws vertices into corners, or
        the nearest border point where there are none. The component along the rim is dropped to keep spacing even.
        """
        positions = vertices[rim.vertices]
        ahead, back = positions[rim.after], positions[rim.before]
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
