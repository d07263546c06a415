"""Where open data ends: the border of a triangulated surface, and that of a cloud of points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from simplexmesh._vec import norm
from simplexmesh.motion.targets import _kernels_borders

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

AROUND = 24
WIDEST = np.deg2rad(110.0)
LOPSIDED = 0.25
"""Of a half disc, the mean is 0.42 radii from the middle of its straight side."""
MOST_POINTS = 60_000
FEWEST = 6


@dataclass(frozen=True, eq=False)
class Border:
    """Points along the lines where data ends.

    Attributes
    ----------
    points : (k, 3) array of float
    width : (k,) array of float
        How wide the line is that each point is on: the diagonal of its box.
    """

    points: Array
    width: Array

    def wider(self, smallest: float) -> Array:
        """Return the points on lines at least so wide."""
        return self.points[self.width >= smallest]


def _lines(points: Array, links: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Return, per point, the width of what it hangs together with, and the number of points there."""
    n = len(points)
    graph = coo_array((np.ones(len(links), bool), links.T.reshape(2, -1)), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, points)
    np.maximum.at(high, label, points)
    return norm(high - low)[label], np.bincount(label, minlength=count)[label]


def border_of_triangles(vertices: Array, faces: NDArray[np.int64], sides: Mask) -> Border:
    """Return the border of a surface, as points along its edges no farther apart than 1/300 of its diagonal.

    Parameters
    ----------
    vertices : (v, 3) array of float
    faces : (f, 3) array of int
    sides : (f, 3) array of bool
        Whether side j of a triangle, from corner j to j + 1, is on the border.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]])
    >>> border = border_of_triangles(corners, np.array([[0, 1, 2]]), np.ones((1, 3), bool))
    >>> border.width.tolist() == [5.0] * len(border.points)
    True
    """
    edges = np.stack([faces[sides], np.roll(faces, -1, axis=1)[sides]], axis=1)
    if not len(edges):
        return Border(np.zeros((0, 3)), np.zeros(0))
    width, _ = _lines(vertices, edges)
    a, b = vertices[edges[:, 0]], vertices[edges[:, 1]]
    step = float(norm(np.ptp(vertices, axis=0))) / 300
    pieces = np.maximum(np.ceil(norm(b - a) / step), 1).astype(np.int64)
    row = np.repeat(np.arange(len(edges)), pieces)
    part = (np.arange(len(row)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[row]
    return Border(a[row] + part[:, None] * (b - a)[row], width[edges[row, 0]])


def border_of_points(points: Array) -> Border:
    """Return the points at which a cloud ends: seen in their tangent plane, their neighbors are on one side.

    A point is on the border when its 24 nearest neighbors leave an angle of 110 degrees free, and their mean is off by
    a quarter of their distance. Points alone, fewer than 6 that hang together, are left out.

    References
    ----------
    G. H. Bendels, R. Schnabel, R. Klein, Detecting holes in point set surfaces, Journal of WSCG 14, 2006 (angle and
    half-disc criteria).

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(12.0), np.arange(10.0))
    >>> border = border_of_points(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1))
    >>> len(border.points) == 2 * 12 + 2 * 8
    True
    """
    if len(points) > MOST_POINTS:
        points = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
    k = min(AROUND, len(points) - 1)
    if k < 3:
        return Border(np.zeros((0, 3)), np.zeros(0))
    tree = cKDTree(points)
    distance, near = tree.query(points, k=k + 1, workers=-1)
    on, normals = _one_sided(points, np.arange(len(points)), near[:, 1:], None)
    # where dense sampling ends at sparse sampling the nearest are on one side too: more of them tell
    _, more = tree.query(points[on], k=min(4 * k, len(points) - 1) + 1, workers=-1)
    still, _ = _one_sided(points, on, more[:, 1:], normals[on])
    on = on[still]
    if not len(on):
        return Border(np.zeros((0, 3)), np.zeros(0))
    ends, reach = points[on], 1.5 * distance[on, min(8, k)]
    pairs = cKDTree(ends).query_pairs(float(np.quantile(reach, 0.9)), output_type="ndarray").astype(np.int64)
    apart = norm(ends[pairs[:, 0]] - ends[pairs[:, 1]])
    pairs = pairs[apart <= reach[pairs].max(axis=1)]
    width, count = _lines(ends, pairs)
    kept = count >= FEWEST
    return Border(ends[kept], width[kept])


def _one_sided(
    points: Array, rows: NDArray[np.int64], near: NDArray[np.int64], normals: Array | None
) -> tuple[NDArray[np.int64], Array]:
    """Return which of some points have their neighbors on one side, and the normals (m, 3) of their planes."""
    found = np.empty((len(rows), 3)) if normals is None else normals
    free, off = np.empty((2, len(rows)))
    points, near = np.ascontiguousarray(points), np.ascontiguousarray(near)  # one layout is compiled, not four
    _kernels_borders.sides(points, rows, near, found, normals is not None, free, off)
    return np.flatnonzero((free > WIDEST) & (off > LOPSIDED)), found
