"""The boundary of a mesh: its attraction to the border of the data, and how it is unfolded."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.vectors import dot, norm, normalized, sums
from simplexmesh.mesh.face_geometry import fan_vectors
from simplexmesh.mesh.simplex_mesh import SimplexMesh
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


def unfolded_boundary(mesh: SimplexMesh) -> SimplexMesh:
    """Return the mesh with the interior neighbors of reversed boundary vertices moved inwards, while that helps."""
    c, now = mesh.connectivity, mesh
    hole = np.asarray(c.face_is_hole[c.vertex_faces].any(axis=1))
    best, rows = mesh, _reversed_vertices(mesh, hole)  # the third neighbor crossed the line between those on the hole
    fewest = len(rows)
    for _ in range(10):  # each moves an interior neighbor by a third
        around = c.neighbors[rows]
        inner = np.unique(around[~hole[around]])
        if not len(inner):
            break
        near = c.neighbors[inner]
        share = np.where(hole[near], 0.0, 1.0)[:, :, None]
        vertices = now.vertices.copy()
        back = (share * vertices[near]).sum(axis=1) / np.maximum(share.sum(axis=1), 1.0)
        vertices[inner] = np.where(share.any(axis=1), 0.7 * vertices[inner] + 0.3 * back, vertices[inner])
        now = now.moved(vertices)
        rows = _reversed_vertices(now, hole)
        if len(rows) < fewest:
            best, fewest = now, len(rows)
    return best


def _reversed_vertices(mesh: SimplexMesh, hole: Mask) -> NDArray[np.intp]:
    """Return the vertices on holes whose normals are opposed to those of their faces."""
    c = mesh.connectivity
    vectors = np.add.reduceat(fan_vectors(mesh.vertices, c.face_vertices, c.face_offsets), c.face_offsets[:-1], axis=0)
    vectors[c.face_is_hole] = 0.0
    return np.flatnonzero(hole & (dot(mesh.normals, vectors[c.face].sum(axis=1)) < 0))
