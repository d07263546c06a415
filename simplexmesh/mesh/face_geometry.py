"""Geometry of the faces of a simplex mesh, each triangulated as a fan around its centroid.

Faces come as in `Connectivity`: face `f` has the vertices `face_vertices[face_offsets[f] : face_offsets[f + 1]]`,
counter-clockwise seen from outside, hole faces included.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, dot, norm, normalized

Array = NDArray[np.float64]
Indices = NDArray[np.int32]


def following(face_vertices: Indices, face_offsets: Indices) -> Indices:
    """Return the next vertex around the face, for each face corner.

    Examples
    --------
    >>> following(np.array([7, 8, 9, 1, 2, 3, 4]), np.array([0, 3, 7]))
    array([8, 9, 7, 2, 3, 4, 1])
    """
    out = np.roll(face_vertices, -1)
    out[face_offsets[1:] - 1] = face_vertices[face_offsets[:-1]]
    return out


def _face_sums(values: Array, face_offsets: Indices) -> Array:
    """Return the sum of per-corner values over each face."""
    return np.add.reduceat(values, face_offsets[:-1], axis=0)


def face_centroids(vertices: Array, face_vertices: Indices, face_offsets: Indices) -> Array:
    """Return the centroid of each face's vertices.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions.
    face_vertices, face_offsets : (3n,) and (f + 1,) arrays of int
        The faces.

    Returns
    -------
    (f, 3) array of float
        Centroids.

    Examples
    --------
    >>> face_centroids(np.array([[0, 0, 0], [3, 0, 0], [0, 3.0, 0]]), np.array([0, 1, 2]), np.array([0, 3]))
    array([[1., 1., 0.]])
    """
    return _face_sums(vertices[face_vertices], face_offsets) / np.diff(face_offsets)[:, None]


def fan_vectors(vertices: Array, face_vertices: Indices, face_offsets: Indices) -> Array:
    """Return the vector area of each fan triangle, one per face corner: its area times its outward unit normal.

    The triangle of a corner consists of that corner, the next one and the centroid of the face.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions.
    face_vertices, face_offsets : (3n,) and (f + 1,) arrays of int
        The faces.

    Returns
    -------
    (3n, 3) array of float
        In the squared unit of `vertices`.

    Examples
    --------
    >>> P = np.array([[0, 0, 0], [3, 0, 0], [0, 3.0, 0]])
    >>> fan_vectors(P, np.array([0, 1, 2]), np.array([0, 3])).sum(axis=0)
    array([0. , 0. , 4.5])
    """
    centroids = np.repeat(face_centroids(vertices, face_vertices, face_offsets), np.diff(face_offsets), axis=0)
    here = vertices[face_vertices] - centroids
    there = vertices[following(face_vertices, face_offsets)] - centroids
    return cross(here, there) / 2


def face_areas(vertices: Array, face_vertices: Indices, face_offsets: Indices) -> Array:
    """Return the area of each face, that of its fan, in the squared unit of `vertices`.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions.
    face_vertices, face_offsets : (3n,) and (f + 1,) arrays of int
        The faces.

    Returns
    -------
    (f,) array of float
        Areas, at least zero.

    Examples
    --------
    >>> face_areas(np.array([[0, 0, 0], [3, 0, 0], [0, 3.0, 0]]), np.array([0, 1, 2]), np.array([0, 3]))
    array([4.5])
    """
    return _face_sums(norm(fan_vectors(vertices, face_vertices, face_offsets)), face_offsets)


def face_normals(vertices: Array, face_vertices: Indices, face_offsets: Indices) -> Array:
    """Return the outward unit normal of each face, the direction of its vector area; zero where that vanishes.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions.
    face_vertices, face_offsets : (3n,) and (f + 1,) arrays of int
        The faces.

    Returns
    -------
    (f, 3) array of float
        Unit vectors or zero.

    Examples
    --------
    >>> face_normals(np.array([[0, 0, 0], [3, 0, 0], [0, 3.0, 0]]), np.array([0, 1, 2]), np.array([0, 3]))
    array([[0., 0., 1.]])
    """
    return normalized(_face_sums(fan_vectors(vertices, face_vertices, face_offsets), face_offsets))


def face_gauss(vertex_normals: Array, face_vertices: Indices, face_offsets: Indices) -> Array:
    """Return the Gaussian measure of each face: the signed area of the spherical polygon of its vertices' normals.

    It is the integral of the Gaussian curvature over the face, dual to the angle deficit of a triangulation:
    positive where the surface is elliptic, negative where it is hyperbolic. Over a closed mesh it sums to
    `4 pi (1 - genus)`; where the normals of a face follow a great circle, as at a cylinder's holes, the side is
    ambiguous and sums may differ by `4 pi`.

    Parameters
    ----------
    vertex_normals : (n, 3) array of float
        Unit normals at the vertices.
    face_vertices, face_offsets : (3n,) and (f + 1,) arrays of int
        The faces.

    Returns
    -------
    (f,) array of float
        Solid angles in steradians.

    References
    ----------
    H. Delingette, thesis, 1994, section 3.3.6. Areas of spherical triangles: A. Van Oosterom and J. Strackee, IEEE
    Trans. Biomed. Eng. 30 (1983) 125.

    Examples
    --------
    >>> octant = face_gauss(np.eye(3), np.array([0, 1, 2]), np.array([0, 3]))
    >>> bool(np.isclose(octant[0], 4 * np.pi / 8))
    True
    """
    mean = normalized(_face_sums(vertex_normals[face_vertices], face_offsets))
    a = np.repeat(mean, np.diff(face_offsets), axis=0)
    b = vertex_normals[face_vertices]
    c = vertex_normals[following(face_vertices, face_offsets)]
    angles = 2 * np.arctan2(dot(a, cross(b, c)), 1 + dot(a, b) + dot(b, c) + dot(c, a))
    return _face_sums(angles, face_offsets)


def enclosed_volume(vertices: Array, face_vertices: Indices, face_offsets: Indices) -> float:
    """Return the volume enclosed by the fans, positive when the faces are counter-clockwise seen from outside.

    A hole among the faces is closed by its own fan.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions.
    face_vertices, face_offsets : (3n,) and (f + 1,) arrays of int
        The faces of a closed surface, holes included.

    Returns
    -------
    float
        In the cubed unit of `vertices`.

    Examples
    --------
    >>> P = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    >>> corners = np.array([0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3])
    >>> round(enclosed_volume(P, corners, np.array([0, 3, 6, 9, 12])), 12) == round(1 / 6, 12)
    True
    """
    local = vertices - vertices.mean(axis=0)
    vectors = fan_vectors(local, face_vertices, face_offsets)
    return float(dot(local[face_vertices], vectors).sum() / 3)


def face_inversions(
    vertices: Array, vertex_normals: Array, face_vertices: Indices, face_offsets: Indices
) -> NDArray[np.int32]:
    """Return for each face the number of fan triangles whose normal opposes the sum of their two vertex normals.

    Parameters
    ----------
    vertices, vertex_normals : (n, 3) arrays of float
        Positions and outward normals.
    face_vertices, face_offsets : (3n,) and (f + 1,) arrays of int
        The faces.

    Returns
    -------
    (f,) array of int
        Zero everywhere on a mesh without folds.

    Examples
    --------
    >>> P = np.array([[0, 0, 0], [3, 0, 0], [0, 3.0, 0]])
    >>> down = np.tile([0, 0, -1.0], (3, 1))
    >>> face_inversions(P, down, np.array([0, 1, 2]), np.array([0, 3]))
    array([3], dtype=int32)
    """
    vectors = fan_vectors(vertices, face_vertices, face_offsets)
    mean = vertex_normals[face_vertices] + vertex_normals[following(face_vertices, face_offsets)]
    against = (dot(vectors, mean) < 0).astype(np.int32)
    return np.add.reduceat(against, face_offsets[:-1], dtype=np.int32)
