"""How far points and triangles are from a surface: exactly, and for certain everywhere on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_boxes as boxes
from simplexmesh.mesh import _kernels_within as kernels

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

BITS = 20
"""Of each coordinate, in the order of the triangles."""

UNSURE, ROUNDED = 0.05, 1e-12
"""Parts of triangles smaller than this part of a distance, or of the largest coordinate, are not cut any more."""


class Nearest:
    """A surface to which distances are asked for.

    Parameters
    ----------
    points : (v, 3) array of float
        Positions, finite.
    triangles : (t, 3) array of int
        Corners; two of them may be the same, so that a line is a surface, too.

    Examples
    --------
    >>> square = Nearest(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    >>> square.distances(np.array([[0.5, 0.2, 2], [4, 1, 4]]))
    array([2., 5.])
    """

    def __init__(self, points: Array, triangles: NDArray[np.integer]) -> None:
        points = np.ascontiguousarray(points, np.float64)
        middles = points[triangles].mean(axis=1)
        low = middles.min(axis=0)
        size = max(float((middles.max(axis=0) - low).max()), np.finfo(float).tiny)
        cells = ((middles - low) / size * (2**BITS - 1)).astype(np.int64)
        self._order = np.argsort(boxes.curve_numbers(cells), kind="stable")
        leaves = 1
        while leaves * boxes.LEAF < len(triangles):
            leaves *= 2
        self._triangles = triangles
        sorted_ = np.ascontiguousarray(triangles[self._order], np.int64)
        self._boxes = boxes.Boxes(points, sorted_, np.empty((2 * leaves, 2, 3)))
        boxes.fill_boxes(self._boxes)

    def places(self, points: Array) -> tuple[Indices, Array, Array]:
        """Return the triangle closest to each of p points, the weights (p, 3) of its corners, and how far it is."""
        found, weights, squared = np.empty(len(points), np.int64), np.empty((len(points), 3)), np.empty(len(points))
        boxes.closest_places(self._boxes, np.ascontiguousarray(points, np.float64), found, weights, squared)
        return self._order[found], weights, np.sqrt(squared)

    def distances(self, points: Array) -> Array:
        """Return how far points (p, 3) are from the surface."""
        return self.places(points)[2]

    def closest_points(self, points: Array) -> tuple[Array, Array]:
        """Return the points (p, 3) of the surface that are closest to points, and how far they are."""
        found, weights, distances = self.places(points)
        corners = self._boxes.points[self._triangles[found]]
        return np.einsum("pi,pik->pk", weights, corners), distances

    def beyond(self, points: Array, triangles: NDArray[np.integer], distance: float) -> tuple[Indices, Array]:
        """Return which triangles are not everywhere within a distance of the surface, and a point of each that is far.

        All others are for certain: see `farthest_points`. The point is nearly the farthest of its triangle. A triangle
        within the distance may be among them where it is nearly that far.
        """
        points, triangles = np.ascontiguousarray(points, np.float64), np.ascontiguousarray(triangles, np.int64)
        out, where = np.empty(len(triangles)), np.empty((len(triangles), 3))
        least = max(UNSURE * distance, ROUNDED * float(np.abs(points).max()))
        kernels.farthest_points(self._boxes, points, triangles, distance, least, out, where)
        found = np.flatnonzero(out)
        return found, where[found]
