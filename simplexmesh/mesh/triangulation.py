"""Triangulation of simplex meshes: a fan in each face, or the dual triangulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.errors import TopologyError
from simplexmesh.mesh import face_geometry
from simplexmesh.mesh.connectivity import Connectivity

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def fan(vertices: Array, connectivity: Connectivity) -> tuple[Array, Indices]:
    """Triangulate each face as a fan around its centroid, holes left open.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions.
    connectivity : Connectivity
        With f faces.

    Returns
    -------
    points : (n + f, 3) array of float
        The vertices of the mesh, then the centroids of its faces.
    triangles : (t, 3) array of int
        Counter-clockwise seen from outside, ordered by face.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> ball = sphere(1)
    >>> points, triangles = fan(ball.vertices, ball.connectivity)
    >>> len(points), len(triangles)
    (32, 60)
    """
    loops = connectivity.face_vertices, connectivity.face_offsets
    solid = ~connectivity.face_is_hole
    number = connectivity.n_vertices + np.cumsum(solid) - 1
    corners = [loops[0], face_geometry.following(*loops), np.repeat(number, connectivity.face_sizes)]
    triangles = np.stack(corners, axis=1)[np.repeat(solid, connectivity.face_sizes)]
    return np.concatenate([vertices, face_geometry.face_centroids(vertices, *loops)[solid]]), triangles


def dual_triangles(vertices: Array, connectivity: Connectivity) -> tuple[Array, Indices]:
    """Return the dual triangulation: a corner at the centroid of each face, a triangle for each vertex.

    Vertices on a hole become border edges and have no triangle. `dual` of the result has the same connectivity: dart
    by dart for a closed mesh, and for an open one whose hole vertices come last, as in the results of `dual`;
    otherwise up to the order of the vertices.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions.
    connectivity : Connectivity
        With f faces.

    Returns
    -------
    points : (f, 3) array of float
        The centroids of the faces of the surface.
    triangles : (t, 3) array of int
        Counter-clockwise seen from outside, in the order of the mesh's vertices.

    Raises
    ------
    TopologyError
        When every vertex lies on a hole.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> ball = sphere(1)
    >>> points, triangles = dual_triangles(ball.vertices, ball.connectivity)
    >>> len(points), len(triangles)
    (12, 20)
    """
    solid = ~connectivity.face_is_hole
    inner = solid[connectivity.face].all(axis=1)
    if not inner.any():
        raise TopologyError("every vertex lies on a hole, so the dual has no triangle")
    number = np.cumsum(solid) - 1
    triangles = number[np.roll(connectivity.face[inner], 1, axis=1)]
    centroids = face_geometry.face_centroids(vertices, connectivity.face_vertices, connectivity.face_offsets)
    return centroids[solid], triangles
