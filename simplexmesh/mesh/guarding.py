"""Vertex moves that create no folds or crossings: towards target positions, or to reduce existing ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_fans as fans
from simplexmesh.mesh import _kernels_guard as kernels
from simplexmesh.mesh import _kernels_untangle, face_geometry
from simplexmesh.mesh._kernels_fitting import Faces
from simplexmesh.mesh.self_intersection import grid_cells
from simplexmesh.mesh.simplex_mesh import SimplexMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

MAX_STEP, MARGIN, CELL = 0.5, 0.15, 3.0
"""In mean edge lengths: the largest move of a vertex, the margin of the faces' boxes, the cells of their grid."""

EPSILON = 1e-9
"""Distances below this count as zero, in mean edge lengths."""

MAX_DOT = 0.0
"""While vertices advance, only non-adjacent faces whose normals have at most this dot product are tested."""

MUTUAL_COSINE = 0.05
"""Smallest cosine between a fan triangle and the normals of its vertices."""

NO_BOUND = -2.0
"""A lower bound that every cosine satisfies; its negative is an upper bound."""

MAX_TRIES, PASSES, ROUNDS = 5, 6, 2


class Guard:
    """Constraints on the vertex moves of a mesh: none may create or worsen a fold or a crossing.

    Parameters
    ----------
    mesh : SimplexMesh
        The mesh; only its connectivity is used.
    faces : Faces
        Its faces, as arrays for the kernels.
    target_normals : (f, 3) array of float
        Unit normals that the faces should have, zero where unknown.
    free : (n,) array of bool
        Whether each vertex may move.
    """

    def __init__(self, mesh: SimplexMesh, faces: Faces, target_normals: Array, free: NDArray[np.bool_]) -> None:
        self._c, self._faces, self._target_normals, self._free = mesh.connectivity, faces, target_normals, free
        one, other = self._c.edge_faces.T.astype(np.int64)
        n_faces = len(target_normals)
        self._adjacent = np.concatenate([one * n_faces + other, other * n_faces + one])

    def advanced(self, mesh: SimplexMesh, target: Array, target_cosine: float) -> Array:
        """Return the vertices, moved towards `target` (n, 3) as far as the constraints allow."""
        m, edge = self._moving(mesh, MAX_DOT)
        kernels.advance(m, target, MAX_STEP * edge, MAX_TRIES, kernels.Bounds(MUTUAL_COSINE, target_cosine))
        return np.array(m.points[: len(target)])

    def untangled(self, mesh: SimplexMesh, mutual: float, target_cosine: float) -> Array:
        """Return the vertices, moved where that reduces the folds and crossings of the faces around them."""
        for _ in range(ROUNDS):
            m, _ = self._moving(mesh, -NO_BOUND)
            n_invalid = _kernels_untangle.untangle(m, PASSES, kernels.Bounds(mutual, target_cosine))
            mesh = mesh.moved(m.points[: mesh.n_vertices])
            if not n_invalid:
                break
        return mesh.vertices

    def _moving(self, mesh: SimplexMesh, max_dot: float) -> tuple[fans.MovingMesh, float]:
        """Return the mesh as arrays for the kernels, see `MAX_DOT` for `max_dot`, and its mean edge length."""
        c, v, f = self._c, mesh.vertices, self._faces
        a, b = v[c.edge_vertices.T]
        edge = float(np.linalg.norm(a - b, axis=1).mean())
        normals = face_geometry.face_normals(v, f.vertices, f.offsets)
        corners = v[f.vertices]
        low = np.minimum.reduceat(corners, f.offsets[:-1], axis=0) - MARGIN * edge
        high = np.maximum.reduceat(corners, f.offsets[:-1], axis=0) + MARGIN * edge
        solid = np.flatnonzero(~f.hole)
        cell = max(CELL * edge, np.finfo(float).tiny)
        offsets, near = _nearby(low[solid], high[solid], normals[solid], max_dot, cell)
        excluded = np.zeros(0, np.int64) if max_dot > 1 else self._adjacent
        near, offsets = _without(near, offsets, solid, len(f.hole), excluded)
        points = np.concatenate([v, face_geometry.face_centroids(v, f.vertices, f.offsets)])
        m = fans.MovingMesh(
            points,
            np.array(mesh.normals),
            self._target_normals,
            np.ascontiguousarray(c.neighbors, np.int32),
            np.ascontiguousarray(c.vertex_faces, np.int32),
            f,
            offsets,
            near,
            np.zeros(len(near)),
            np.zeros(len(f.hole)),
            EPSILON * edge,
            np.zeros(len(f.hole), bool),
            self._free,
        )
        fans.mark_crossed(m)
        return m, edge


def _nearby(low: Array, high: Array, normals: Array, max_dot: float, cell: float) -> tuple[NDArray[np.int64], Indices]:
    """Return the overlapping boxes of each box; see `overlapping_boxes`."""
    origin = low.min(axis=0)
    cell, shape = grid_cells(high.max(axis=0) - origin, cell, len(low))
    return _kernels_untangle.overlapping_boxes(low, high, normals, max_dot, origin, cell, shape)


def _without(
    near: Indices, offsets: NDArray[np.int64], solid: NDArray[np.int64], n_faces: int, excluded: NDArray[np.int64]
) -> tuple[Indices, NDArray[np.int64]]:
    """Return the lists of nearby faces, renumbered from solid faces to all, without pairs `one * n_faces + other`."""
    owner, other = np.repeat(solid, np.diff(offsets)), solid[near]
    kept = ~np.isin(owner * n_faces + other, excluded)
    counts = np.bincount(owner[kept], minlength=n_faces)
    return other[kept].astype(np.int32), np.concatenate([[0], np.cumsum(counts)])
