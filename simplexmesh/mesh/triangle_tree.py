"""Bounding-box tree of triangles: exact distances of points, certified distance bounds of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_farthest
from simplexmesh.mesh import _kernels_triangle_tree as kernels

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BITS = 20
"""Bits of each coordinate in the Morton order of the triangles."""

RESOLUTION, ROUNDING = 0.05, 1e-12
"""Parts of triangles smaller than this times the distance, or times the largest coordinate, are not bisected."""


class TriangleTree:
    """Triangles in a bounding-box tree, for distance queries.

    Parameters
    ----------
    points : (v, 3) array of float
        Positions, finite.
    triangles : (t, 3) array of int
        Corners; degenerate triangles are allowed, such as segments with two corners the same.

    Examples
    --------
    >>> square = TriangleTree(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    >>> square.distances(np.array([[0.5, 0.2, 2], [4, 1, 4]]))
    array([2., 5.])
    """

    def __init__(self, points: Array, triangles: NDArray[np.integer]) -> None:
        points = np.ascontiguousarray(points, np.float64)
        centroids = points[triangles].mean(axis=1)
        low = centroids.min(axis=0)
        size = max(float((centroids.max(axis=0) - low).max()), np.finfo(float).tiny)
        cells = ((centroids - low) / size * (2**BITS - 1)).astype(np.int64)
        self._order = np.argsort(kernels.morton_codes(cells), kind="stable")
        leaves = 1
        while leaves * kernels.LEAF < len(triangles):
            leaves *= 2
        self._triangles = triangles
        ordered = np.ascontiguousarray(triangles[self._order], np.int64)
        self._tree = kernels.BoxTree(points, ordered, np.empty((2 * leaves, 2, 3)))
        kernels.fit_boxes(self._tree)

    def closest(self, points: Array) -> tuple[Indices, Array, Array]:
        """Return the closest triangle of each of p points, barycentric coordinates (p, 3) there, and the distance."""
        found, weights, squared = np.empty(len(points), np.int64), np.empty((len(points), 3)), np.empty(len(points))
        kernels.closest_points(self._tree, np.ascontiguousarray(points, np.float64), found, weights, squared)
        return self._order[found], weights, np.sqrt(squared)

    def distances(self, points: Array) -> Array:
        """Return the distances (p,) of points (p, 3) from the surface."""
        return self.closest(points)[2]

    def closest_points(self, points: Array) -> tuple[Array, Array]:
        """Return the closest points (p, 3) of the surface to points, and their distances."""
        found, weights, distances = self.closest(points)
        corners = self._tree.points[self._triangles[found]]
        return np.einsum("pi,pik->pk", weights, corners), distances

    def beyond(self, points: Array, triangles: NDArray[np.integer], distance: float) -> tuple[Indices, Array]:
        """Return the triangles not certified to lie within a distance of the surface, and a far point of each.

        All others are certainly within it; see `farthest_points`. The point is nearly the farthest of its triangle.
        A triangle just within the distance may be returned too.
        """
        points, triangles = np.ascontiguousarray(points, np.float64), np.ascontiguousarray(triangles, np.int64)
        out, where = np.empty(len(triangles)), np.empty((len(triangles), 3))
        smallest = max(RESOLUTION * distance, ROUNDING * float(np.abs(points).max()))
        _kernels_farthest.farthest_points(self._tree, points, triangles, distance, smallest, out, where)
        found = np.flatnonzero(out)
        return found, where[found]
