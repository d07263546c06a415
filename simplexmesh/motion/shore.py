"""Where the data ends, the mesh should: rims drawn to the border of the data, across their own direction."""

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
NARROWEST = 3.0
"""In mean edges of the mesh: it cannot have a rim around holes of the data that are not wider."""
TAKEN = 1.5
"""In distances between neighbors on the rim: farther points of the border are some other rim's."""


class Shore:
    """The border of the data, as rims of a mesh see it.

    Parameters
    ----------
    points : (k, 3) array of float
        Along the border.
    weight : float
        The share of the way to the border that a rim goes in one iteration.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> flat = sm.plane(vertices=200)
    >>> square = np.linspace(-0.6, 0.6, 40)
    >>> side = np.full(40, 0.6)
    >>> border = np.concatenate([np.stack([x, y, 0 * x], 1) for x, y in ((square, side), (square, -side))])
    >>> rim = Rim.of(flat.connectivity)
    >>> Shore(border, 0.3).pull(flat.vertices, rim, 1.0).shape == (len(rim.vertices), 3)
    True
    """

    def __init__(self, points: Array, weight: float) -> None:
        if len(points) > MOST_POINTS:
            points = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
        self.points, self.weight = points, weight
        self._tree = cKDTree(points)

    @classmethod
    def of(cls, target: Any, mesh: SimplexMesh, weight: float) -> Shore:
        """Return the border of a target; without points where the target knows none, or the mesh has no rim."""
        border = getattr(target, "border", None) if mesh.n_holes and weight else None
        if border is None:
            return cls(np.zeros((0, 3)), weight)
        ends = mesh.vertices[mesh.connectivity.edge_vertices]
        return cls(border.wider(NARROWEST * float(norm(ends[:, 0] - ends[:, 1]).mean())), weight)

    def added(self, extra: Array | None, vertices: Array, rim: Rim, reach: float) -> Array:
        """Return displacements (n, 3) with the pull of the border added on the rims."""
        out = np.zeros_like(vertices) if extra is None else extra.copy()
        if len(self.points):
            out[rim.vertices] += self.pull(vertices, rim, reach)
        return out

    def pull(self, vertices: Array, rim: Rim, reach: float) -> Array:
        """Return (m, 3) the step of each vertex on a rim towards the border.

        Its goal is half way between the nearest point of the border and the mean of those points of the border that it
        is the nearest vertex to: these draw it into corners. Along the rim it is not drawn, to keep vertices even.
        """
        places = vertices[rim.vertices]
        ahead, back = places[rim.after], places[rim.before]
        distance, nearest = self._tree.query(places)
        step = self.points[nearest] - places
        near, owner = cKDTree(places).query(self.points)
        side = 0.5 * (norm(ahead - places) + norm(back - places))
        taken = near < TAKEN * side[owner]
        count = np.bincount(owner[taken], minlength=len(places))
        total = np.zeros_like(places)
        np.add.at(total, owner[taken], self.points[taken])
        has = count > 0
        step[has] = total[has] / count[has, None] - places[has]
        along = normalized(ahead - back)
        step -= dot(step, along)[:, None] * along
        step[distance > reach] = 0.0
        return np.asarray(self.weight * step)
