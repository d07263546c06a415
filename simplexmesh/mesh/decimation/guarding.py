"""Vertex moves that create no folds or crossings: towards target positions, or to reduce existing ones."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm
from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.decimation import _kernels_fans as fans
from simplexmesh.mesh.decimation import _kernels_guard as kernels
from simplexmesh.mesh.decimation._kernels_fitting import Faces
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangles.self_intersection import overlapping_boxes

MAX_STEP, MARGIN = 0.5, 0.15
"""In mean edge lengths: the largest move of a vertex (half of it leaves faces 3 % farther, without limit moves to far
targets fold faces) and the margin of the faces' boxes (without it 9 of 81 decimations end tangled, else 6)."""

MUTUAL_COSINE = 0.05
"""Smallest cosine between a fan triangle and the normals of its vertices: at zero, too, 9 of 81 end tangled."""

TRIES = 6
"""Steps tried for a vertex, each half of the last, and passes over folds: a single step leaves faces 15 % farther."""


class Guard:
    """Constraints on the vertex moves of a mesh: none may create or worsen a fold or a crossing."""

    def __init__(self, mesh: SimplexMesh, faces: Faces, target_normals: Array, free: Mask) -> None:
        self._c, self._faces, self._target_normals, self._free = mesh.connectivity, faces, target_normals, free

    def advanced(self, mesh: SimplexMesh, target: Array, target_cosine: float) -> Array:
        """Return the vertices, moved towards `target` (n, 3) as far as the constraints allow."""
        m, bounds = self._moving(mesh, self._facing_pairs(mesh)), kernels.Bounds(MUTUAL_COSINE, target_cosine)
        kernels.advance(m, target, MAX_STEP * _mean_edge(mesh), TRIES, bounds)
        return m.points[: len(target)]

    def untangled(self, mesh: SimplexMesh, mutual: float, target_cosine: float) -> Array:
        """Return the vertices, moved where that reduces the folds and crossings of the faces around them."""
        solid = np.flatnonzero(~self._faces.hole)
        m = self._moving(mesh, np.concatenate([self._near_pairs(mesh), np.stack([solid, solid], axis=1)]))
        kernels.untangle(m, TRIES, kernels.Bounds(mutual, target_cosine))
        return m.points[: mesh.n_vertices]

    def _near_pairs(self, mesh: SimplexMesh) -> Indices:
        """Return the pairs (m, 2) of solid faces whose boxes, with a margin, overlap."""
        f, edge = self._faces, _mean_edge(mesh)
        corners, solid = mesh.vertices[f.vertices], np.flatnonzero(~f.hole)
        low = np.minimum.reduceat(corners, f.offsets[:-1], axis=0)[solid] - MARGIN * edge
        high = np.maximum.reduceat(corners, f.offsets[:-1], axis=0)[solid] + MARGIN * edge
        return np.asarray(solid[overlapping_boxes(low, high, 3 * edge)])

    def _facing_pairs(self, mesh: SimplexMesh) -> Indices:
        """Return those that are not adjacent and have opposed normals, as two sides of a wall."""
        pairs, n_faces = self._near_pairs(mesh), len(self._faces.hole)
        normals = face_geometry.face_normals(mesh.vertices, self._faces.vertices, self._faces.offsets)
        beside = np.sort(self._c.edge_faces.astype(np.int64), axis=1)
        adjacent = np.isin(pairs[:, 0] * n_faces + pairs[:, 1], beside[:, 0] * n_faces + beside[:, 1])
        return pairs[~adjacent & (dot(*normals[pairs.T]) <= 0)]

    def _moving(self, mesh: SimplexMesh, pairs: Indices) -> fans.MovingMesh:
        """Return the mesh as arrays for the kernels, with the pairs of faces that may cross."""
        c, v, f = self._c, mesh.vertices, self._faces
        both = np.concatenate([pairs, pairs[pairs[:, 0] < pairs[:, 1], ::-1]])
        both = both[np.argsort(both[:, 0], kind="stable")]
        m = fans.MovingMesh(
            np.concatenate([v, face_geometry.face_centroids(v, f.vertices, f.offsets)]),
            np.array(mesh.normals),
            self._target_normals,
            c.neighbors,
            c.vertex_faces,
            f,
            np.searchsorted(both[:, 0], np.arange(len(f.hole) + 1)),
            both[:, 1].astype(np.int32),
            np.zeros(len(f.hole), bool),
            self._free,
        )
        fans.mark_crossed(m)
        return m


def _mean_edge(mesh: SimplexMesh) -> float:
    a, b = mesh.vertices[mesh.connectivity.edge_vertices.T]
    return float(norm(a - b).mean())
