"""Triangulation of simplex meshes: a fan in each face, flat or curved, or the dual triangulation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.named_arrays import Data, joined, taken
from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.numerics.blending import blended


def fan(vertices: Array, connectivity: Connectivity, faces: Indices | None = None) -> tuple[Array, Indices]:
    """Return the vertices, then the centroids of the solid faces, or those given, and the fan triangles by face."""
    c = connectivity
    faces = np.flatnonzero(~c.face_is_hole) if faces is None else faces
    sizes = c.face_sizes[faces]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    corners = c.face_vertices[np.arange(offsets[-1]) + np.repeat(c.face_offsets[faces] - offsets[:-1], sizes)]
    centers = len(vertices) + np.repeat(np.arange(len(faces)), sizes)
    triangles = np.stack([corners, face_geometry.following(corners, offsets), centers], axis=1)
    return np.concatenate([vertices, face_geometry.face_centroids(vertices, corners, offsets)]), triangles


def curved_fan(
    vertices: Array, normals: Array, connectivity: Connectivity, crease: NDArray[Any] | None
) -> tuple[Array, Indices]:
    """Return what `fan` does, raised to the smooth surface: centers onto it, vertices as far as chords are within it.

    The normals of vertices on holes and creases (n,) are of one side, or between two, and tell nothing.
    """
    c = connectivity
    _, triangles = fan(vertices, c)
    untold = c.face_is_hole[c.face].any(axis=1)
    if crease is not None:
        untold = np.logical_or(untold, crease)
    normals = np.where(np.reshape(untold, (-1, 1)), 0.0, normals)
    points = face_geometry.raised(vertices, normals, c)
    centers = face_geometry.curved_centers(points, normals, c.face_vertices, c.face_offsets)
    return np.concatenate([points, centers[~c.face_is_hole]]), triangles


def dual_triangles(vertices: Array, connectivity: Connectivity) -> tuple[Array, Indices]:
    """Return the dual triangulation: centroids of solid faces, a triangle for each vertex that is on no hole."""
    solid = ~connectivity.face_is_hole
    inner = solid[connectivity.face].all(axis=1)
    if not inner.any():
        raise TopologyError("every vertex lies on a hole, so the dual has no triangle")
    number = np.cumsum(solid) - 1
    triangles = number[np.roll(connectivity.face[inner], 1, axis=1)]
    centroids = face_geometry.face_centroids(vertices, connectivity.face_vertices, connectivity.face_offsets)
    return centroids[solid], triangles


def data_of_faces(data: Data, connectivity: Connectivity) -> dict[str, NDArray[Any]]:
    """Return named arrays of the solid faces: means over the vertices of each."""
    if not data:
        return {}
    solid = np.flatnonzero(~connectivity.face_is_hole)
    sizes, starts = connectivity.face_sizes[solid], connectivity.face_offsets[solid]
    groups = [np.flatnonzero(sizes == size) for size in np.unique(sizes)]
    corners = [connectivity.face_vertices[starts[g, None] + np.arange(sizes[g[0]])] for g in groups]
    found = joined([blended(data, rows, np.ones(rows.shape)) for rows in corners])
    return taken(found, np.argsort(np.concatenate(groups)))
