"""The boundary of a mesh: the vertices on holes, which move as closed contours in space, not as a surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices32, Mask
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.face_geometry import fan_vectors
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model import _kernels_boundary
from simplexmesh.motion.model._kernels_boundary import Outlines
from simplexmesh.motion.model._kernels_step import SHAPE, Forces, Moving, Step

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

    @classmethod
    def of(cls, target: Any, edge: float, weight: float) -> BorderAttraction:
        """Return the attraction of a target's border to a mesh of this mean edge; of no points without a border."""
        return cls(wide_border(target if weight else None, edge), weight)

    def displacements(self, vertices: Array, outlines: Outlines, reach: float) -> Array:
        """Return (m, 3) the way, across its hole, of each boundary vertex to the mean of its nearest points."""
        positions = vertices[outlines.vertices]
        ahead, back = positions[outlines.after], positions[outlines.before]
        distance, nearest = self._tree.query(positions)
        step = self.points[nearest] - positions
        near, owner = cKDTree(positions).query(self.points)  # means of what is nearest draw vertices into corners
        side = 0.5 * (norm(ahead - positions) + norm(back - positions))
        assigned = near < MAX_SPACING * side[owner]
        count = np.bincount(owner[assigned], minlength=len(positions))
        total = np.zeros_like(positions)
        np.add.at(total, owner[assigned], self.points[assigned])
        matched = count > 0
        step[matched] = total[matched] / count[matched, None] - positions[matched]
        along = normalized(ahead - back)
        step -= dot(step, along)[:, None] * along  # keeps the spacing along the hole
        step[distance > reach] = 0.0
        return np.asarray(self.weight * step)


def outlines_of(connectivity: Connectivity) -> Outlines:
    """Return the vertices on holes, each with its neighbors along its hole."""
    holes = np.flatnonzero(connectivity.face_is_hole)
    sizes, offsets = connectivity.face_sizes[holes], connectivity.face_offsets
    first = np.repeat(np.cumsum(sizes) - sizes, sizes)
    place, size = np.arange(len(first)) - first, np.repeat(sizes, sizes)
    vertices = connectivity.face_vertices[np.repeat(offsets[holes], sizes) + place]
    before, after = first + (place - 1) % size, first + (place + 1) % size
    return Outlines(vertices, before.astype(np.int32), after.astype(np.int32))


class Boundary:
    """The boundary under the internal force of 1-simplex meshes (Delingette 1994, sections 3.2 and 4.8), and others."""

    def __init__(self, mesh: SimplexMesh, reference: SimplexMesh, attraction: BorderAttraction) -> None:
        self.outlines, self.attraction = outlines_of(mesh.connectivity), attraction
        self._shape = BoundaryShape(self.outlines.vertices, reference.vertices, mesh.neighbors)

    def step(
        self, moving: Moving, normals: Array, constraint: NDArray[np.int8], extra: Array | None, reach: float,
        forces: Forces, out: Step,
    ) -> None:  # fmt: skip
        """Fill the rows of the next step of the boundary, displaced by `extra` (n, 3) too."""
        extra = np.zeros_like(moving.vertices) if extra is None else extra.copy()
        if len(self.attraction.points):
            extra[self.outlines.vertices] += self.attraction.displacements(moving.vertices, self.outlines, reach)
        goals = self.goals(moving.vertices, constraint)
        _kernels_boundary.boundary_step(self.outlines.vertices, moving, normals, goals, extra, forces, out)

    def goals(self, vertices: Array, constraint: NDArray[np.int8]) -> Array:
        """Return (m, 3) the goal of the internal force at each vertex of the boundary."""
        out = np.zeros((len(self.outlines.vertices), 3))
        elastic = (constraint[self.outlines.vertices] == SHAPE).any()
        restored = self._shape.positions(vertices) if elastic else out
        _kernels_boundary.boundary_goals(vertices, self.outlines, constraint, restored, out)
        return out


class BoundaryShape:
    """Positions of the boundary relative to the vertices within two edges, taken from a reference mesh (n, 3).

    A contour in space has no normal, and frames of the few nearest neighbors amplify errors. The least-squares
    similarity between whole neighborhoods does not (M. Müller et al., "Meshless deformations based on shape matching",
    ACM Transactions on Graphics 24 (3), 2005).
    """

    def __init__(self, rows: Indices32, vertices: Array, neighbors: Indices32) -> None:
        near = neighbors[rows]
        self._neighborhoods = np.concatenate([rows[:, None], near, neighbors[near].reshape(-1, 9)], axis=1)
        weights = np.ones(self._neighborhoods.shape)
        weights[:, 4:][self._neighborhoods[:, 4:] == rows[:, None]] = 0.0
        self._weights = weights / weights.sum(axis=1, keepdims=True)
        self._offsets, _ = self._centered(vertices)
        self._size2 = np.maximum((self._weights * dot(self._offsets, self._offsets)).sum(axis=1), 1e-300)

    def _centered(self, vertices: Array) -> tuple[Array, Array]:
        """Return each neighborhood (m, 13, 3) relative to its weighted centroid, and the centroids (m, 3)."""
        positions = vertices[self._neighborhoods]
        centers = np.einsum("mk,mki->mi", self._weights, positions)
        return positions - centers[:, None], centers

    def positions(self, vertices: Array) -> Array:
        """Return (m, 3) the reference positions, mapped by the best similarity to each present neighborhood."""
        offsets, centers = self._centered(vertices)
        U, S, Vt = np.linalg.svd(np.einsum("mki,mk,mkj->mij", offsets, self._weights, self._offsets))
        sign = np.where(np.linalg.det(U) * np.linalg.det(Vt) < 0, -1.0, 1.0)
        U[:, :, 2] *= sign[:, None]
        scale = (S[:, 0] + S[:, 1] + sign * S[:, 2]) / self._size2
        return centers + scale[:, None] * np.einsum("mij,mjk,mk->mi", U, Vt, self._offsets[:, 0])


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
