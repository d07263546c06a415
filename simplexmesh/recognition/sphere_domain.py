"""The spherical domain of signatures: point location, interpolation and Möbius transformations."""

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

MINIMUM_FREQUENCY, MAXIMUM_FREQUENCY = 5, 12
"""Frequencies of signatures: 500 to 2,880 vertices."""


def checked_frequency(frequency: int) -> int:
    """Return `frequency` if signatures can have it.

    Raises
    ------
    ValueError, TypeError

    Examples
    --------
    >>> checked_frequency(9)
    9
    """
    return _check.integer("frequency", frequency, MINIMUM_FREQUENCY, MAXIMUM_FREQUENCY)


@dataclass(frozen=True, eq=False)
class Locations:
    """Barycentric coordinates of directions in triangles of a vertex and the centers of two of its faces.

    Attributes
    ----------
    vertex : (k,) array of int
        The vertex whose dual cell holds the direction; mostly the nearest.
    faces : (k, 2) array of int
    weights : (k, 3) array of float
        Of the vertex and the two faces; nonnegative, with sum 1.
    """

    vertex: Indices
    faces: Indices
    weights: Array


@dataclass(frozen=True, eq=False)
class SphereDomain:
    """The quasi-regular sphere of a frequency, with linear interpolation on it; made by `sphere_domain`.

    Attributes
    ----------
    mesh : SimplexMesh
        Of radius one about the origin.
    centers : (f, 3) array of float
        The mean of the vertices of each face; slightly inside the sphere.
    """

    mesh: SimplexMesh
    centers: Array

    @property
    def vertices(self) -> Array:
        """(n, 3) unit vectors."""
        return self.mesh.vertices

    @cached_property
    def cell_areas(self) -> Array:
        """(n,) solid angle of each vertex's dual cell, whose corners are the centers of its faces; sum 4 pi."""
        a, b, c = np.moveaxis(self.centers[self.mesh.connectivity.face], 1, 0)
        a, b, c = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b, c))
        sums = 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1)  # van Oosterom and Strackee 1983
        return 2 * np.arctan2(np.einsum("ij,ij->i", a, np.cross(b, c)), sums)

    def locate(self, directions: Array, start: Indices | None = None) -> Locations:
        """Return the locations of unit vectors (k, 3), by walks from vertices `start` (k,) or from seeds nearby."""
        k = len(directions)
        if start is None:
            start = self._seed_vertices[np.argmax(directions @ self._seeds.T, axis=1)]
        vertex, faces, weights = np.zeros(k, np.int64), np.zeros((k, 2), np.int64), np.zeros((k, 3))
        topology = (self.mesh.neighbors, self.mesh.connectivity.face)
        _kernels_match.locate(
            np.ascontiguousarray(directions, dtype=np.float64),
            *(np.asarray(start, np.int64), self.vertices, *topology, self.centers, vertex, faces, weights),
        )
        return Locations(vertex, faces, weights)

    @cached_property
    def _seed_vertices(self) -> Indices:
        """About 40 vertices where walks start."""
        return np.arange(0, len(self.vertices), max(1, len(self.vertices) // 40))

    @cached_property
    def _seeds(self) -> Array:
        return np.ascontiguousarray(self.vertices[self._seed_vertices])

    def face_means(self, values: Array) -> Array:
        """Return the mean of values (n, ...) over the vertices of each face, (f, ...)."""
        connectivity = self.mesh.connectivity
        sums = np.add.reduceat(values[connectivity.face_vertices], connectivity.face_offsets[:-1], axis=0)
        return np.asarray(sums / connectivity.face_sizes.reshape((-1,) + (1,) * (values.ndim - 1)))

    def interpolated(self, values: Array, locations: Locations) -> Array:
        """Return values (n, ...) at locations, (k, ...): linear between vertices and the means over faces."""
        means = self.face_means(values)
        weights = locations.weights.reshape(locations.weights.shape + (1,) * (values.ndim - 1))
        near = weights[:, 0] * values[locations.vertex]
        return np.asarray(
            near + weights[:, 1] * means[locations.faces[:, 0]] + weights[:, 2] * means[locations.faces[:, 1]]
        )


@lru_cache(maxsize=16)
def sphere_domain(frequency: int) -> SphereDomain:
    """Return the sphere of a frequency; cached.

    Examples
    --------
    >>> domain = sphere_domain(5)
    >>> locations = domain.locate(domain.vertices)
    >>> bool(np.allclose(domain.interpolated(domain.vertices, locations), domain.vertices))
    True
    """
    mesh = sphere(frequency)
    connectivity = mesh.connectivity
    sums = np.add.reduceat(mesh.vertices[connectivity.face_vertices], connectivity.face_offsets[:-1], axis=0)
    return SphereDomain(mesh, sums / connectivity.face_sizes[:, None])


def mobius_map(points: Array, center: Array) -> Array:
    """Return unit vectors (k, 3) under the Möbius transformation of the ball that takes `center`, inside it, to zero.

    The map is conformal and preserves circles; its inverse is the map of ``-center``.

    Examples
    --------
    >>> points = sphere_domain(5).vertices
    >>> b = np.array([0.3, 0.1, -0.2])
    >>> bool(np.allclose(mobius_map(mobius_map(points, b), -b), points))
    True
    """
    square = float(center @ center)
    difference = points - center
    return (1 - square) * difference / np.einsum("ij,ij->i", difference, difference)[:, None] - center


def mobius_centering(points: Array, weights: Array, *, iterations: int = 50) -> list[Array]:
    """Return Möbius transformations whose composition brings the weighted mean of unit vectors to zero.

    Newton's method. The composition is unique up to a rotation unless half of the weight is at one point.

    Parameters
    ----------
    points : (k, 3) array of float
    weights : (k,) array of float

    Returns
    -------
    list of (3,) arrays of float
        The centers to apply `mobius_map` with, in order.

    References
    ----------
    J. Hersch, 1970, for existence; A. Baden, K. Crane, M. Kazhdan, *Möbius registration*, 2018, for its use.

    Examples
    --------
    >>> points, weights = sphere_domain(5).vertices, 1.5 + sphere_domain(5).vertices[:, 2]
    >>> for b in mobius_centering(points, weights):
    ...     points = mobius_map(points, b)
    >>> bool(np.abs(weights @ points).max() < 1e-6)
    True
    """
    fractions, steps = weights / weights.sum(), []
    for _ in range(iterations):
        mean = fractions @ points
        if np.linalg.norm(mean) < 1e-9:
            break
        spread = 2 * (np.eye(3) - (points * fractions[:, None]).T @ points)
        b = np.linalg.solve(spread + 1e-9 * np.eye(3), mean)
        b *= min(1.0, 0.5 / float(np.linalg.norm(b)))
        steps.append(b)
        points = mobius_map(points, b)
    return steps
