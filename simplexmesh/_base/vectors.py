"""Dot and cross products, norms and unit vectors of stacked vectors."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array


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


def tangents(normals: Array) -> tuple[Array, Array]:
    """Return unit tangents u, v with u x v = n of a stack of unit normals; u is the x axis projected, or the y axis."""
    axis = np.eye(3)[np.where(np.abs(normals[..., 0]) < 0.9, 0, 1)]
    u = normalized(axis - dot(axis, normals)[..., None] * normals)
    return u, cross(normals, u)
