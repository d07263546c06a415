"""Correction of boundary vertices whose normals are reversed, by moving their interior neighbors back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.vectors import dot
from simplexmesh.mesh.face_geometry import fan_vectors
from simplexmesh.mesh.simplex_mesh import SimplexMesh


def unfolded_boundary(mesh: SimplexMesh) -> SimplexMesh:
    """Return the mesh with the interior neighbors of reversed boundary vertices moved inwards, while that helps.

    At a corner of a hole the normal, of the plane of the three neighbors, flips when the interior neighbor crosses the
    line between the other two.
    """
    c, now = mesh.connectivity, mesh
    hole = np.asarray(c.face_is_hole[c.vertex_faces].any(axis=1))
    best, rows = mesh, _reversed_vertices(mesh, hole)
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


def _reversed_vertices(mesh: SimplexMesh, hole: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the vertices on holes whose normals are opposed to those of their faces."""
    c = mesh.connectivity
    vectors = np.add.reduceat(fan_vectors(mesh.vertices, c.face_vertices, c.face_offsets), c.face_offsets[:-1], axis=0)
    vectors[c.face_is_hole] = 0.0
    return np.flatnonzero(hole & (dot(mesh.normals, vectors[c.face].sum(axis=1)) < 0))
