"""Dot and cross products, norms, unit vectors and sums of stacked vectors; normals of triangles."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices


def dot(a: Array, b: Array) -> Array:
    """Return the dot products of two stacks of vectors, over the last axis."""
    return np.einsum("...i,...i->...", a, b)


def cross(a: Array, b: Array) -> Array:
    """Return the cross products of two stacks of 3-vectors; several times faster than `numpy.cross`."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def norm(a: Array) -> Array:
    """Return the Euclidean norms of a stack of vectors."""
    return np.sqrt(dot(a, a))


def normalized(a: Array) -> Array:
    """Return the vectors scaled to unit length; a zero vector stays zero."""
    length = norm(a)[..., None]
    return np.divide(a, length, out=np.zeros_like(a), where=length > 0)


def triangle_vectors(points: Array, triangles: Indices) -> Array:
    """Return the normals (t, 3) of triangles, as long as twice their areas."""
    a, b, c = (points[triangles[:, j]] for j in range(3))
    return cross(b - a, c - a)


def sums(vectors: Array, rows: Indices, n: int) -> Array:
    """Return the sums (n, k) of the vectors (m, k) in each of the `rows` (m,)."""
    return np.stack([np.bincount(rows, column, n) for column in vectors.T], axis=1, dtype=np.float64)


def vertex_normals(points: Array, triangles: Indices) -> Array:
    """Return the unit vertex normals (n, 3), means of those of triangles by area; zero at points of none."""
    return normalized(sums(np.tile(triangle_vectors(points, triangles), (3, 1)), triangles.T.ravel(), len(points)))


def tangents(normals: Array) -> tuple[Array, Array]:
    """Return unit tangents u, v with u x v = n of a stack of unit normals; u is the x axis projected, or the y axis."""
    axis = np.eye(3)[np.where(np.abs(normals[..., 0]) < 0.9, 0, 1)]
    u = normalized(axis - dot(axis, normals)[..., None] * normals)
    return u, cross(normals, u)
