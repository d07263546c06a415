"""Triangulation of simplex meshes: a fan in each face, or the dual triangulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.errors import TopologyError
from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def fan(vertices: Array, connectivity: Connectivity) -> tuple[Array, Indices]:
    """Return the vertices, then the centroids of the solid faces, and the fan triangles, ordered by face."""
    loops = connectivity.face_vertices, connectivity.face_offsets
    solid = ~connectivity.face_is_hole
    number = connectivity.n_vertices + np.cumsum(solid) - 1
    corners = [loops[0], face_geometry.following(*loops), np.repeat(number, connectivity.face_sizes)]
    triangles = np.stack(corners, axis=1)[np.repeat(solid, connectivity.face_sizes)]
    return np.concatenate([vertices, face_geometry.face_centroids(vertices, *loops)[solid]]), triangles


def dual_triangles(vertices: Array, connectivity: Connectivity) -> tuple[Array, Indices]:
    """Return the dual triangulation: centroids of solid faces, a triangle for each vertex that is on no hole.

    `dual` of the result has the same connectivity, dart by dart if the hole vertices come last, as in the results of
    `dual`; otherwise up to the order of the vertices.
    """
    solid = ~connectivity.face_is_hole
    inner = solid[connectivity.face].all(axis=1)
    if not inner.any():
        raise TopologyError("every vertex lies on a hole, so the dual has no triangle")
    number = np.cumsum(solid) - 1
    triangles = number[np.roll(connectivity.face[inner], 1, axis=1)]
    centroids = face_geometry.face_centroids(vertices, connectivity.face_vertices, connectivity.face_offsets)
    return centroids[solid], triangles
