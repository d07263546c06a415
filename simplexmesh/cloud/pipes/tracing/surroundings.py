"""A cloud thinned to the detail that a pipe of one radius needs, with normals of what is looked at."""

from __future__ import annotations

from copy import copy
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm
from simplexmesh.numerics.plane_fits import fitted

CELLS = 8
"""Cells of the thinned cloud in a radius: points of a cell lie on one side of the pipe, nearly in a plane."""

NEIGHBORS = 32
"""Of a plane fit: as many cells as half a radius around a point has on a flat surface."""

AT_LEAST, WIDER = 12, 0.75
"""... and so many within so many radii, where lines of a scanner are half a radius apart."""

NOISY, UNEVEN = 4.0, 0.01
"""Noises of the cloud, and radii: points of a pipe do not deviate more. Dents and shifts of stations are less, and what
smooth bodies and crossing walls have of a pipe is nearly always more."""


class Surroundings:
    """Means of the points in cells, and planes through their neighbors, fitted where they are first asked for.

    Directions that an axis may have do not depend on how dense the scan is: a dense one is averaged, a sparse one kept.
    """

    def __init__(self, points: Array, radius: float, *, radius_is_given: bool = False, noise: float = np.inf) -> None:
        self.radius, self.radius_is_given, self.noise = radius, radius_is_given, noise
        self.points = thinned(points, 2.0 ** np.floor(np.log2(radius / CELLS)))
        self._normals = np.zeros_like(self.points)
        self._known = np.zeros(len(self.points), bool)

    @property
    def most_deviation(self) -> float:
        """Of points of the pipe."""
        return max(NOISY * self.noise, UNEVEN * self.radius)

    @cached_property
    def tree(self) -> cKDTree:
        """Of the points."""
        return cKDTree(self.points, balanced_tree=False, compact_nodes=False)

    @cached_property
    def size(self) -> float:
        """Length of the box of the points, from corner to corner."""
        return float(norm(np.ptp(self.points, axis=0)))

    def cropped(self, places: Array, reach: float) -> Surroundings:
        """Return what is within reach of some of the places."""
        near = np.zeros(len(self.points), bool)
        for found in self.tree.query_ball_point(places, reach):
            near[found] = True
        out = copy(self)
        out.__dict__.pop("tree")
        out.points, out._normals, out._known = self.points[near], self._normals[near], self._known[near]
        return out

    def of(self, radius: float) -> Surroundings:
        """Return them as a pipe of another radius has them."""
        return Surroundings(self.points, radius, noise=self.noise)

    def near(self, place: Array, reach: float) -> Indices:
        """Return which points are within reach of a place."""
        return np.array(self.tree.query_ball_point(place, reach), dtype=np.int64)

    def normals(self, at: Indices) -> Array:
        """Return unit normals (k, 3), of either sign, of some of the points."""
        new = at[~self._known[at]]
        if len(new):
            count = min(NEIGHBORS, len(self.points))
            reach, ranks = WIDER * self.radius, [*range(1, count + 1)]
            distance, near = self.tree.query(self.points[new], k=ranks, distance_upper_bound=reach)
            near_by, wider = ((distance < share * self.radius).sum(axis=1) for share in (0.5, WIDER))
            found = np.maximum(near_by, np.minimum(wider, AT_LEAST))
            near = np.take_along_axis(near, np.arange(count) % found[:, None], axis=1)  # those found, again and again
            self._normals[new], self._known[new] = fitted(self.points, near)[0], True
        return self._normals[at]


def thinned(points: Array, cell: float) -> Array:
    """Return the means of the points in each cell of a grid."""
    key = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    size = key.max(axis=0) + 1
    number = (key[:, 0] * size[1] + key[:, 1]) * size[2] + key[:, 2]
    _, index, count = np.unique(number, return_inverse=True, return_counts=True)
    index = index.ravel()
    return np.stack([np.bincount(index, points[:, k]) for k in range(3)], axis=1) / count[:, None]
