"""Corners of rims that look the right way: their neighbors inside drawn back behind them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import dot
from simplexmesh.mesh.face_geometry import fan_vectors
from simplexmesh.mesh.simplex_mesh import SimplexMesh

ROUNDS = 10


def reversed_on_rims(mesh: SimplexMesh) -> NDArray[np.intp]:
    """Return the vertices on holes whose normals point against those of their faces.

    The normal of a vertex is that of its three neighbors' plane. At a corner of a rim these turn over when the one
    inside comes past the line between the other two.
    """
    c = mesh.connectivity
    fans = fan_vectors(mesh.vertices, c.face_vertices, c.face_offsets)
    vectors = np.add.reduceat(fans, c.face_offsets[:-1], axis=0)
    vectors[c.face_is_hole] = 0.0
    on_rim = np.asarray(c.face_is_hole[c.vertex_faces].any(axis=1))
    return np.flatnonzero(on_rim & (dot(mesh.normals, vectors[c.face].sum(axis=1)) < 0))


def uprighted(mesh: SimplexMesh) -> SimplexMesh:
    """Return the mesh with the neighbors inside of such vertices drawn back, as long as that helps.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> flat = sm.plane(vertices=300)
    >>> rim = flat.connectivity.face_is_hole[flat.connectivity.vertex_faces].any(axis=1)
    >>> inside = np.setdiff1d(flat.neighbors[np.argmax(rim)], np.flatnonzero(rim))[0]
    >>> vertices = flat.vertices.copy()
    >>> vertices[inside] += 1.2 * (vertices[np.argmax(rim)] - vertices[inside])
    >>> worse = flat.moved(vertices)
    >>> len(reversed_on_rims(worse)), len(reversed_on_rims(uprighted(worse)))
    (1, 0)
    """
    best, fewest = mesh, len(reversed_on_rims(mesh))
    for _ in range(ROUNDS):
        if not fewest:
            break
        c, rows = mesh.connectivity, reversed_on_rims(mesh)
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
        if (left := len(reversed_on_rims(mesh))) < fewest:
            best, fewest = mesh, left
    return best
