"""The spherical domain of signatures: point location, interpolation and Möbius transformations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.shapes import sphere
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.recognition.sai import _kernels_rotations
from simplexmesh.recognition.sai._kernels_rotations import SphereMesh


def checked_frequency(frequency: int) -> int:
    """Return `frequency` if signatures can have it: 500 to 2,880 vertices."""
    return checks.integer("frequency", frequency, 5, 12)


@dataclass(frozen=True, eq=False)
class SphereLocations:
    """Barycentric coordinates of directions in triangles of a vertex and the centers of two of its faces."""

    vertex: Indices  # (k,) the vertex whose dual cell holds the direction; mostly the nearest
    faces: Indices  # (k, 2)
    weights: Array  # (k, 3) of the vertex and the two faces; nonnegative, with sum 1


@dataclass(frozen=True, eq=False)
class SphereDomain:
    """The quasi-regular sphere of a frequency, with linear interpolation on it; made by `sphere_domain`."""

    mesh: SimplexMesh  # of radius one about the origin

    @property
    def vertices(self) -> Array:
        """(n, 3) unit vectors."""
        return self.mesh.vertices

    @cached_property
    def centers(self) -> Array:
        """(f, 3) the mean of the vertices of each face, slightly inside the sphere."""
        return self.face_means(self.vertices)

    @property
    def arrays(self) -> SphereMesh:
        """The sphere as kernels take it."""
        return SphereMesh(self.vertices, self.mesh.neighbors, self.mesh.connectivity.face, self.centers)

    @cached_property
    def cell_areas(self) -> Array:
        """(n,) solid angle of each vertex's dual cell, whose corners are the centers of its faces; sum 4 pi."""
        a, b, c = np.moveaxis(self.centers[self.mesh.connectivity.face], 1, 0)
        a, b, c = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b, c))
        sums = 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1)  # van Oosterom and Strackee 1983
        return 2 * np.arctan2(np.einsum("ij,ij->i", a, np.cross(b, c)), sums)

    def locate(self, directions: Array) -> SphereLocations:
        """Return the locations of unit vectors (k, 3), by walks from the nearest of about 40 vertices."""
        k, step = len(directions), max(1, len(self.vertices) // 40)
        start = step * np.argmax(directions @ self.vertices[::step].T, axis=1)
        vertex, faces, weights = np.zeros(k, np.int64), np.zeros((k, 2), np.int64), np.zeros((k, 3))
        directions = np.ascontiguousarray(directions, dtype=np.float64)
        _kernels_rotations.locate(directions, start, self.arrays, vertex, faces, weights)
        return SphereLocations(vertex, faces, weights)

    def face_means(self, values: Array) -> Array:
        """Return the mean of values (n, ...) over the vertices of each face, (f, ...)."""
        connectivity = self.mesh.connectivity
        return face_centroids(values, connectivity.face_vertices, connectivity.face_offsets)

    def interpolated(self, values: Array, locations: SphereLocations) -> Array:
        """Return values (n, ...) at locations, (k, ...): linear between vertices and the means over faces."""
        means = self.face_means(values)
        weights = locations.weights.reshape(locations.weights.shape + (1,) * (values.ndim - 1))
        near = weights[:, 0] * values[locations.vertex]
        return np.asarray(
            near + weights[:, 1] * means[locations.faces[:, 0]] + weights[:, 2] * means[locations.faces[:, 1]]
        )


@lru_cache(maxsize=16)
def sphere_domain(frequency: int) -> SphereDomain:
    """Return the sphere of a frequency; cached."""
    return SphereDomain(sphere(frequency))


def mobius_map(points: Array, center: Array) -> Array:
    """Return unit vectors (k, 3) under the conformal (Möbius) map of the ball that takes `center`, to zero."""
    square = float(center @ center)
    difference = points - center
    return (1 - square) * difference / np.einsum("ij,ij->i", difference, difference)[:, None] - center


def mobius_centering(points: Array, weights: Array) -> list[Array]:
    """Return centers (3,) for `mobius_map`, in order, that bring the weighted mean of unit vectors (k, 3) to zero."""
    # Newton; they exist (J. Hersch, 1970) unless half of the weight is at one point (Baden, Crane, Kazhdan, 2018)
    fractions, steps = weights / weights.sum(), []
    for _ in range(50):
        mean = fractions @ points
        if np.linalg.norm(mean) < 1e-9:
            break
        spread = 2 * (np.eye(3) - (points * fractions[:, None]).T @ points)
        b = np.linalg.solve(spread + 1e-9 * np.eye(3), mean)
        b *= min(1.0, 0.5 / float(np.linalg.norm(b)))
        steps.append(b)
        points = mobius_map(points, b)
    return steps
