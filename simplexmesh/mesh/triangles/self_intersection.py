"""Self-intersections: pairs of triangles, or of faces as fans, of which an edge passes through the other's interior.

Touching and overlapping in a plane do not count. Determinants decide, with a bound on their rounding errors: J. R.
Shewchuk, *Adaptive precision floating-point arithmetic ...*, Discrete Comput. Geom. 18 (1997) 305.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from simplexmesh._base.arrays import Array, Indices, Indices32, Mask
from simplexmesh._base.vectors import cross, dot, normalized
from simplexmesh.mesh import triangulation
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.triangles import _kernels_intersection


def crossing_triangles(points: Array, triangles: Indices, among: Mask | None = None) -> Indices:
    """Return the pairs (m, 2) of triangles that cross, sorted, the smaller index first; with `among` (t,) one is so."""
    points, triangles = np.ascontiguousarray(points, np.float64), np.ascontiguousarray(triangles, np.int64)
    if not len(triangles):
        return np.zeros((0, 2), np.int64)
    low, high = _boxes(points, triangles)
    pairs = overlapping_boxes(low, high, 2 * float((high - low).max(axis=1).mean()))
    pairs = pairs if among is None else pairs[among[pairs].any(axis=1)]
    starts = np.arange(len(triangles) + 1)
    pairs = _crossing(points, triangles, starts, (low, high), pairs)
    return pairs[np.lexsort(pairs.T[::-1])]


def _crossing(
    points: Array, triangles: Indices, starts: Indices, boxes: tuple[Array, Array], pairs: Indices
) -> Indices:
    """Return the pairs of fans of triangles that cross."""
    out = np.empty(len(pairs), bool)
    _kernels_intersection.are_crossing_fans(len(pairs), points, triangles, starts, boxes, pairs, out)
    return pairs[out]


def overlapping_boxes(low: Array, high: Array, cell: float) -> Indices:
    """Return the pairs (m, 2) of overlapping boxes (b, 3), by a grid whose cells grow until they are about 8 a box."""
    origin, largest = low.min(axis=0), float((high - low).max())
    size = high.max(axis=0) - origin
    cell = max(cell, largest / 16, float(size.max()) * 1e-6, np.finfo(float).tiny)
    while math.prod((size // cell + 1).tolist()) > 8 * len(low) + 64:
        cell *= 1.25
    return _kernels_intersection.overlapping_boxes(low, high, origin, cell, (size // cell).astype(np.int64) + 1)


def self_intersections(vertices: Array, connectivity: Connectivity, among: Mask | None = None) -> Indices:
    """Return the sorted pairs (m, 2) of faces whose fans cross; one whose fan crosses itself is paired with itself.

    With `among` (f,) the pairs of these faces and their surroundings: not all, but all with one of these.
    """
    faces = np.flatnonzero(~connectivity.face_is_hole)
    if among is not None:
        places = vertices[connectivity.face_vertices]
        faces = faces[_beside(places, connectivity.face_offsets, faces, among[faces])]
    if not len(faces):
        return np.zeros((0, 2), np.int64)
    points, triangles = triangulation.fan(vertices, connectivity, faces)
    starts = np.append(0, np.cumsum(connectivity.face_sizes[faces]))
    boxes = _boxes(points, triangles)
    low, high = np.minimum.reduceat(boxes[0], starts[:-1]), np.maximum.reduceat(boxes[1], starts[:-1])
    pairs = overlapping_boxes(low, high, float((high - low).max(axis=1).mean()))
    pairs = np.concatenate([np.repeat(np.arange(len(faces)), 2).reshape(-1, 2), pairs])
    pairs = _crossing(points, triangles, starts, boxes, pairs)
    pairs = faces[pairs[np.lexsort(pairs.T[::-1])]]
    own = pairs[pairs[:, 0] == pairs[:, 1], 0]  # flat ones, whose triangles touch, seem to within rounding
    corners = (connectivity.face_vertices[slice(*connectivity.face_offsets[f : f + 2])] for f in own)
    graphs = own[[_is_graph(vertices[each]) for each in corners]]
    return pairs[(pairs[:, 0] != pairs[:, 1]) | ~np.isin(pairs[:, 0], graphs)]


def _is_graph(corners: Array) -> bool:
    """Return whether the fan of a face (k, 3) goes once around its centroid as seen along its normal."""
    spokes = corners - corners.mean(axis=0)
    vectors = cross(spokes, np.roll(spokes, -1, axis=0))
    normal = normalized(vectors.sum(axis=0, keepdims=True))
    flat = spokes - dot(spokes, normal)[:, None] * normal
    turns = np.arctan2(dot(vectors, normal), dot(flat, np.roll(flat, -1, axis=0)))
    return bool((turns > 0).all() and turns.sum() < 3 * np.pi)


def _boxes(points: Array, triangles: Indices) -> tuple[Array, Array]:
    """Return the lowest and highest corners (t, 3) of the bounding boxes of triangles."""
    a, b, c = points[triangles.T]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _beside(corners: Array, offsets: Indices32, faces: Indices, chosen: Mask) -> Mask:
    """Return a mask (m,) of faces near those chosen: boxes that meet begin in neighboring cells as large as any."""
    if not chosen.any():
        return chosen
    low, high = (bound.reduceat(corners, offsets[:-1], axis=0)[faces] for bound in (np.minimum, np.maximum))
    origin = low.min(axis=0)
    cell = max(1.001 * float((high - low).max()), float((low - origin).max()) / 64, np.finfo(float).tiny)
    at = np.ravel_multi_index(tuple(((low - origin) // cell).astype(np.int64).T + 1), (67, 67, 67))
    met = np.zeros((67, 67, 67), bool)
    met.ravel()[at[chosen]] = True
    return np.asarray(ndimage.maximum_filter(met, 3).ravel()[at])
