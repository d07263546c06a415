"""Geometry of the faces of a simplex mesh, holes included, each triangulated as a fan around its centroid."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.vectors import cross, dot, norm, normalized
from simplexmesh.mesh.connectivity import Connectivity

STEEP = 0.7
"""Cosine between the normals of a face and a vertex; figures of smooth bodies are the same from 0.5 to 0.9."""


def following(face_vertices: Indices32, face_offsets: Indices32) -> Indices32:
    """Return the next vertex around the face, for each face corner."""
    out = np.roll(face_vertices, -1)
    out[face_offsets[1:] - 1] = face_vertices[face_offsets[:-1]]
    return out


def _face_sums(values: Array, face_offsets: Indices32) -> Array:
    """Return the sum of per-corner values over each face."""
    return np.add.reduceat(values, face_offsets[:-1], axis=0)


def face_centroids(values: Array, face_vertices: Indices32, face_offsets: Indices32) -> Array:
    """Return the mean (f, ...) of positions, or any other values (n, ...), over each face's vertices."""
    return np.asarray((_face_sums(values[face_vertices], face_offsets).T / np.diff(face_offsets)).T)


def raised(vertices: Array, normals: Array, connectivity: Connectivity) -> Array:
    """Return vertices (n, 3) moved along their unit normals until chords cut off as much as they add.

    A quarter of the height over the neighbors: triangles with vertices on a paraboloid are off it in the mean by an
    eighth of curvature times squared edge where hexagons are regular, these heights are half of it. Where a face is
    `STEEP`, as on an edge of few vertices, and where the normal is zero, nothing moves.
    """
    c = connectivity
    facing = face_normals(vertices, c.face_vertices, c.face_offsets)[c.face]
    smooth = (dot(facing, normals[:, None]) > STEEP).all(axis=1)
    height = dot(vertices - vertices[c.neighbors].mean(axis=1), normals)
    return vertices + np.where(smooth, height / 4, 0.0)[:, None] * normals


def curved_centers(vertices: Array, normals: Array, face_vertices: Indices32, face_offsets: Indices32) -> Array:
    """Return each face's centroid (f, 3), lifted onto the smooth surface that the vertices and their unit normals tell.

    Half the way to the mean of its projections onto the tangent planes, which is exact on paraboloids: T. Boubekeur and
    M. Alexa, Phong tessellation, ACM Trans. Graph. 27 (2008) 141. Planes that are `STEEP`, as across a crease, and
    normals of zero tell nothing.
    """
    centroids, sizes = face_centroids(vertices, face_vertices, face_offsets), np.diff(face_offsets)
    tangent = normals[face_vertices]
    facing = np.repeat(face_normals(vertices, face_vertices, face_offsets), sizes, axis=0)
    rise = dot(vertices[face_vertices] - np.repeat(centroids, sizes, axis=0), tangent)
    smooth = dot(tangent, facing) > STEEP
    lift = _face_sums((smooth * rise)[:, None] * tangent, face_offsets)
    return centroids + lift / np.maximum(2 * _face_sums(smooth.astype(int), face_offsets), 1)[:, None]


def fan_vectors(vertices: Array, face_vertices: Indices32, face_offsets: Indices32) -> Array:
    """Return the vector areas (3n, 3) of the fan triangles, each of a corner, the next one and the centroid."""
    centroids = np.repeat(face_centroids(vertices, face_vertices, face_offsets), np.diff(face_offsets), axis=0)
    here = vertices[face_vertices] - centroids
    there = vertices[following(face_vertices, face_offsets)] - centroids
    return cross(here, there) / 2


def face_areas(vertices: Array, face_vertices: Indices32, face_offsets: Indices32) -> Array:
    """Return the area (f,) of each face, that of its fan."""
    return _face_sums(norm(fan_vectors(vertices, face_vertices, face_offsets)), face_offsets)


def face_normals(vertices: Array, face_vertices: Indices32, face_offsets: Indices32) -> Array:
    """Return the unit normal (f, 3) of each face, along its vector area; zero where that vanishes."""
    return normalized(_face_sums(fan_vectors(vertices, face_vertices, face_offsets), face_offsets))


def face_gauss(vertex_normals: Array, face_vertices: Indices32, face_offsets: Indices32) -> Array:
    """Return the Gaussian measure (f,) of each face: the solid angle of the polygon of its vertices' unit normals.

    The integral of the Gaussian curvature, 4 pi (1 - genus) over a closed mesh, but 4 pi off where normals follow a
    great circle. Thesis, section 3.3.6; A. Van Oosterom and J. Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125.
    """
    mean = normalized(_face_sums(vertex_normals[face_vertices], face_offsets))
    a = np.repeat(mean, np.diff(face_offsets), axis=0)
    b = vertex_normals[face_vertices]
    c = vertex_normals[following(face_vertices, face_offsets)]
    angles = 2 * np.arctan2(dot(a, cross(b, c)), 1 + dot(a, b) + dot(b, c) + dot(c, a))
    return _face_sums(angles, face_offsets)


def enclosed_volume(vertices: Array, face_vertices: Indices32, face_offsets: Indices32) -> float:
    """Return the volume enclosed by the fans of all faces, holes included; positive when they are counter-clockwise."""
    local = vertices - vertices.mean(axis=0)
    vectors = fan_vectors(local, face_vertices, face_offsets)
    return float(dot(local[face_vertices], vectors).sum() / 3)


def face_inversions(vectors: Array, normals: Array, face_vertices: Indices32, face_offsets: Indices32) -> Indices32:
    """Return for each face (f,) the number of its `fan_vectors` that oppose the normals (3n, 3) at two corners."""
    mean = normals + normals[following(np.arange(len(face_vertices), dtype=np.int32), face_offsets)]
    against = (dot(vectors, mean) < 0).astype(np.int32)
    return np.add.reduceat(against, face_offsets[:-1], dtype=np.int32)
