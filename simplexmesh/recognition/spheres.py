"""The sphere that signatures live on: directions, interpolation between vertices, conformal maps onto itself."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.shapes import sphere
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.recognition import _kernels_match

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LOWEST, HIGHEST = 5, 12
"""Frequencies of signatures: 500 to 2,880 vertices."""


def checked_frequency(frequency: int) -> int:
    """Return a frequency that signatures can have.

    Raises
    ------
    ValueError, TypeError

    Examples
    --------
    >>> checked_frequency(9)
    9
    """
    return _check.integer("frequency", frequency, LOWEST, HIGHEST)


@dataclass(frozen=True, eq=False)
class Places:
    """Directions among the vertices of a sphere: each is a mean of a vertex and the centers of two of its faces.

    Attributes
    ----------
    vertex : (k,) array of int
        The vertex whose faces' centers surround the direction; mostly the nearest.
    faces : (k, 2) array of int
    weights : (k, 3) array of float
        Of the vertex and the two faces, with sum one, none negative.
    """

    vertex: Indices
    faces: Indices
    weights: Array


@dataclass(frozen=True, eq=False)
class Ball:
    """The quasi-regular sphere of a frequency and what is needed to interpolate on it; made by `ball`.

    Attributes
    ----------
    mesh : SimplexMesh
        Of radius one about the origin.
    centers : (f, 3) array of float
        The mean of the vertices of each face, somewhat below the sphere.
    """

    mesh: SimplexMesh
    centers: Array

    @property
    def vertices(self) -> Array:
        """(n, 3) unit vectors."""
        return self.mesh.vertices

    @cached_property
    def cell_areas(self) -> Array:
        """(n,) the part of the unit sphere that belongs to each vertex, its faces' centers the corners; sum 4 pi."""
        a, b, c = np.moveaxis(self.centers[self.mesh.connectivity.face], 1, 0)
        a, b, c = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b, c))
        sums = 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1)  # van Oosterom and Strackee 1983
        return 2 * np.arctan2(np.einsum("ij,ij->i", a, np.cross(b, c)), sums)

    def places(self, directions: Array, start: Indices | None = None) -> Places:
        """Return where unit vectors (k, 3) are; the walk there is short from a `start` (k,) nearby."""
        k = len(directions)
        here = np.argmax(directions @ self._posts.T, axis=1) if start is None else start
        begin = self._post_vertices[here] if start is None else np.asarray(start, np.int64)
        vertex, faces, weights = np.zeros(k, np.int64), np.zeros((k, 2), np.int64), np.zeros((k, 3))
        topology = (self.mesh.neighbors, self.mesh.connectivity.face)
        _kernels_match.locate(
            np.ascontiguousarray(directions, dtype=np.float64),
            *(begin, self.vertices, *topology, self.centers, vertex, faces, weights),
        )
        return Places(vertex, faces, weights)

    @cached_property
    def _post_vertices(self) -> Indices:
        """Every few vertices, where walks begin."""
        return np.arange(0, len(self.vertices), max(1, len(self.vertices) // 40))

    @cached_property
    def _posts(self) -> Array:
        return np.ascontiguousarray(self.vertices[self._post_vertices])

    def face_means(self, values: Array) -> Array:
        """Return the mean of values (n, ...) over the vertices of each face, (f, ...)."""
        connectivity = self.mesh.connectivity
        sums = np.add.reduceat(values[connectivity.face_vertices], connectivity.face_offsets[:-1], axis=0)
        return np.asarray(sums / connectivity.face_sizes.reshape((-1,) + (1,) * (values.ndim - 1)))

    def interpolated(self, values: Array, places: Places) -> Array:
        """Return values (n, ...) at places, (k, ...): linear between vertices and the means over faces."""
        means = self.face_means(values)
        weights = places.weights.reshape(places.weights.shape + (1,) * (values.ndim - 1))
        near = weights[:, 0] * values[places.vertex]
        return np.asarray(near + weights[:, 1] * means[places.faces[:, 0]] + weights[:, 2] * means[places.faces[:, 1]])


@lru_cache(maxsize=16)
def ball(frequency: int) -> Ball:
    """Return the sphere of a frequency, the same object every time.

    Examples
    --------
    >>> round_one = ball(5)
    >>> places = round_one.places(round_one.vertices)
    >>> bool(np.allclose(round_one.interpolated(round_one.vertices, places), round_one.vertices))
    True
    """
    mesh = sphere(frequency)
    connectivity = mesh.connectivity
    sums = np.add.reduceat(mesh.vertices[connectivity.face_vertices], connectivity.face_offsets[:-1], axis=0)
    return Ball(mesh, sums / connectivity.face_sizes[:, None])


def boosted(points: Array, toward: Array) -> Array:
    """Return unit vectors (k, 3) under the conformal map of the sphere that takes `toward`, inside it, to the center.

    The map crowds points away from `toward` and keeps circles circles; its inverse is the same with `-toward`.

    Examples
    --------
    >>> points = ball(5).vertices
    >>> b = np.array([0.3, 0.1, -0.2])
    >>> bool(np.allclose(boosted(boosted(points, b), -b), points))
    True
    """
    square = float(toward @ toward)
    off = points - toward
    return (1 - square) * off / np.einsum("ij,ij->i", off, off)[:, None] - toward


def centering(points: Array, weights: Array, *, most: int = 50) -> list[Array]:
    """Return the conformal maps, one after the other, that bring the weighted mean of unit vectors to the center.

    Newton's method; the result is unique up to a rotation unless half of the weight is in one place.

    Parameters
    ----------
    points : (k, 3) array of float
    weights : (k,) array of float

    Returns
    -------
    list of (3,) arrays of float
        What to give `boosted`, in order.

    References
    ----------
    J. Hersch, 1970, for the existence; A. Baden, K. Crane, M. Kazhdan, Möbius registration, 2018, for the use.

    Examples
    --------
    >>> points, weights = ball(5).vertices, 1.5 + ball(5).vertices[:, 2]
    >>> for b in centering(points, weights):
    ...     points = boosted(points, b)
    >>> bool(np.abs(weights @ points).max() < 1e-6)
    True
    """
    share, steps = weights / weights.sum(), []
    for _ in range(most):
        mean = share @ points
        if np.linalg.norm(mean) < 1e-9:
            break
        spread = 2 * (np.eye(3) - (points * share[:, None]).T @ points)
        b = np.linalg.solve(spread + 1e-9 * np.eye(3), mean)
        b *= min(1.0, 0.5 / float(np.linalg.norm(b)))
        steps.append(b)
        points = boosted(points, b)
    return steps
