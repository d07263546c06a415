"""Self-intersections: pairs of triangles, or of faces as fans, that cross."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import _kernels_crossing, triangulation
from simplexmesh.mesh.connectivity import Connectivity

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def crossing_triangles(points: Array, triangles: Indices) -> Indices:
    """Return the pairs of triangles that cross.

    Triangles cross when an edge of one passes through the interior of the other; touching, meeting in a shared corner
    or edge, and overlapping in one plane do not count. Orientation determinants decide, with a bound on their rounding
    errors, so that flat and nearly flat regions give no false positives.

    Parameters
    ----------
    points : (v, 3) array of float
        Positions, finite.
    triangles : (t, 3) array of int
        Corners.

    Returns
    -------
    (m, 2) array of int
        Each pair once, the smaller index first, sorted.

    References
    ----------
    J. R. Shewchuk, *Adaptive precision floating-point arithmetic and fast robust geometric predicates*, Discrete
    Comput. Geom. 18 (1997) 305, for the bound.

    Examples
    --------
    >>> points = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 1.0]])
    >>> crossing_triangles(points, np.array([[0, 1, 2], [3, 4, 5]]))
    array([[0, 1]])
    """
    triangles = np.ascontiguousarray(triangles, np.int64)
    if not len(triangles):
        return np.zeros((0, 2), np.int64)
    a, b, c = (points[corner] for corner in triangles.T)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    origin = low.min(axis=0)
    size = high.max(axis=0) - origin
    extents = (high - low).max(axis=1)
    cell = max(2 * float(extents.mean()), float(extents.max()) / 16, float(size.max()) * 1e-6)
    if cell == 0:
        return np.zeros((0, 2), np.int64)
    cell, shape = grid_cells(size, cell, len(triangles))
    pairs = _kernels_crossing.crossing_triangles(
        np.ascontiguousarray(points, np.float64), triangles, low, high, origin, cell, shape
    )
    return pairs[np.lexsort(pairs.T[::-1])]


def grid_cells(size: Array, cell: float, count: int) -> tuple[float, Indices]:
    """Return the cell size, enlarged until the grid has at most about 8 cells per box, and the grid's shape (3,)."""
    while math.prod((size // cell + 1).tolist()) > 8 * count + 64:
        cell *= 1.25
    return cell, (size // cell).astype(np.int64) + 1


def self_intersections(vertices: Array, connectivity: Connectivity) -> Indices:
    """Return the pairs of faces whose fans cross; a face whose fan crosses itself is paired with itself.

    Parameters
    ----------
    vertices : (n, 3) array of float
        Positions, finite.
    connectivity : Connectivity
        The topology; holes are ignored.

    Returns
    -------
    (m, 2) array of int
        Faces as numbered in the connectivity, each pair once, the smaller index first, sorted.

    Examples
    --------
    >>> from simplexmesh.mesh.shapes import sphere
    >>> ball = sphere(4)
    >>> len(self_intersections(ball.vertices, ball.connectivity))
    0
    """
    points, triangles = triangulation.fan(vertices, connectivity)
    faces = np.flatnonzero(~connectivity.face_is_hole)
    owner = np.repeat(faces, connectivity.face_sizes[faces])
    return np.unique(np.sort(owner[crossing_triangles(points, triangles)], axis=1), axis=0)
