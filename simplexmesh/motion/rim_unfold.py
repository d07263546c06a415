"""Correction of rim vertices whose normals are reversed, by moving their interior neighbors back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import dot
from simplexmesh.mesh.face_geometry import fan_vectors
from simplexmesh.mesh.simplex_mesh import SimplexMesh

ROUNDS = 10


def reversed_rim_vertices(mesh: SimplexMesh) -> NDArray[np.intp]:
    """Return the vertices on holes whose normals are opposed to those of their faces.

    The normal of a vertex is that of its three neighbors' plane. At a corner of a rim it flips when the interior
    neighbor crosses the line between the other two.
    """
    c = mesh.connectivity
    fans = fan_vectors(mesh.vertices, c.face_vertices, c.face_offsets)
    vectors = np.add.reduceat(fans, c.face_offsets[:-1], axis=0)
    vectors[c.face_is_hole] = 0.0
    on_rim = np.asarray(c.face_is_hole[c.vertex_faces].any(axis=1))
    return np.flatnonzero(on_rim & (dot(mesh.normals, vectors[c.face].sum(axis=1)) < 0))


def unfolded_rims(mesh: SimplexMesh) -> SimplexMesh:
    """Return the mesh with the interior neighbors of such vertices moved inwards, as long as that reduces their number.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> flat = sm.plane(vertices=300)
    >>> rim = flat.connectivity.face_is_hole[flat.connectivity.vertex_faces].any(axis=1)
    >>> inside = np.setdiff1d(flat.neighbors[np.argmax(rim)], np.flatnonzero(rim))[0]
    >>> vertices = flat.vertices.copy()
    >>> vertices[inside] += 1.2 * (vertices[np.argmax(rim)] - vertices[inside])
    >>> worse = flat.moved(vertices)
    >>> len(reversed_rim_vertices(worse)), len(reversed_rim_vertices(unfolded_rims(worse)))
    (1, 0)
    """
    best, fewest = mesh, len(reversed_rim_vertices(mesh))
    for _ in range(ROUNDS):
        if not fewest:
            break
        c, rows = mesh.connectivity, reversed_rim_vertices(mesh)
        around = c.neighbors[rows]
        hole = np.asarray(c.face_is_hole[c.vertex_faces].any(axis=1))
        inner = np.unique(around[~hole[around]])
        if not len(inner):
            break
        vertices = mesh.vertices.copy()
        near = c.neighbors[inner]
        share = np.where(hole[near], 0.0, 1.0)[:, :, None]
        back = (share * vertices[near]).sum(axis=1) / np.maximum(share.sum(axis=1), 1.0)
        vertices[inner] = np.where(share.any(axis=1), 0.7 * vertices[inner] + 0.3 * back, vertices[inner])
        mesh = mesh.moved(vertices)
        if (left := len(reversed_rim_vertices(mesh))) < fewest:
            best, fewest = mesh, left
    return best
