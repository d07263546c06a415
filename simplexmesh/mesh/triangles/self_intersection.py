"""Self-intersections: pairs of triangles, or of faces as fans, that cross.

Triangles cross when an edge of one passes through the interior of the other; touching, meeting in a shared corner or
edge, and overlapping in one plane do not count. Orientation determinants decide, with a bound on their rounding errors:
J. R. Shewchuk, *Adaptive precision floating-point arithmetic and fast robust geometric predicates*, Discrete Comput.
Geom. 18 (1997) 305.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray

from simplexmesh.mesh import triangulation
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.triangles import _kernels_crossing

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def crossing_triangles(points: Array, triangles: Indices) -> Indices:
    """Return the pairs (m, 2) of triangles that cross, sorted, the smaller index first."""
    triangles = np.ascontiguousarray(triangles, np.int64)
    if not len(triangles):
        return np.zeros((0, 2), np.int64)
    a, b, c = points[triangles.T]
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    pairs = overlapping_boxes(low, high, 2 * float((high - low).max(axis=1).mean()))
    pairs = pairs[_kernels_crossing.are_crossing(np.ascontiguousarray(points, np.float64), triangles, pairs)]
    return pairs[np.lexsort(pairs.T[::-1])]


def overlapping_boxes(low: Array, high: Array, cell: float) -> Indices:
    """Return the pairs (m, 2) of overlapping boxes (b, 3), by a grid whose cells grow until they are about 8 a box."""
    origin, largest = low.min(axis=0), float((high - low).max())
    size = high.max(axis=0) - origin
    cell = max(cell, largest / 16, float(size.max()) * 1e-6, np.finfo(float).tiny)
    while math.prod((size // cell + 1).tolist()) > 8 * len(low) + 64:
        cell *= 1.25
    return _kernels_crossing.overlapping_boxes(low, high, origin, cell, (size // cell).astype(np.int64) + 1)


def self_intersections(vertices: Array, connectivity: Connectivity, among: NDArray[np.bool_] | None = None) -> Indices:
    """Return the sorted pairs (m, 2) of faces whose fans cross; one whose fan crosses itself is paired with itself.

    With `among` (f,) the pairs of these faces and their surroundings: not all, but all with one of these.
    """
    points, triangles = triangulation.fan(vertices, connectivity)
    faces = np.flatnonzero(~connectivity.face_is_hole)
    owner = np.repeat(faces, connectivity.face_sizes[faces])
    if among is not None:
        beside = _beside(points[triangles], among[owner])
        triangles, owner = triangles[beside], owner[beside]
    return np.unique(np.sort(owner[crossing_triangles(points, triangles)], axis=1), axis=0)


def _beside(corners: Array, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which triangles (t, 3, 3) meet a cell of a grid, none smaller than any, that one of those chosen meets."""
    if not chosen.any():
        return chosen
    low, high = corners.min(axis=1), corners.max(axis=1)
    origin = low.min(axis=0)
    cell = max(1.001 * float((high - low).max()), float((high - origin).max()) / 64, np.finfo(float).tiny)
    ends = ((np.stack([low, high]) - origin) // cell).astype(np.int64)
    shape = ends.max(axis=(0, 1)) + 1
    cells = [np.ravel_multi_index(tuple(ends[k, :, axis] for axis, k in enumerate(way)), shape)
             for way in product((0, 1), repeat=3)]  # fmt: skip
    met = np.zeros(int(shape.prod()), bool)
    for cell_of in cells:
        met[cell_of[chosen]] = True
    return np.asarray(np.any([met[cell_of] for cell_of in cells], axis=0))
