"""Borders of open data: of triangulated surfaces and of point clouds.

Those of clouds by the angle and half-disc criteria of G. H. Bendels, R. Schnabel, R. Klein, Detecting holes in point
set surfaces, Journal of WSCG 14, 2006.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm, tangents
from simplexmesh.numerics.plane_fits import fitted, subsampled

NEIGHBORS = 24
MIN_ANGLE_GAP = np.deg2rad(110.0)
MIN_OFFSET = 0.25
"""The centroid of a half disc is 0.42 radii from the middle of its diameter."""
MAX_POINTS = 60_000
MIN_POINTS = 6


@dataclass(frozen=True, eq=False)
class Border:
    """Points along the border lines of open data: what a target may have as its `border`.

    Attributes
    ----------
    points : (k, 3) array of float
    width : (k,) array of float
        Length of the diagonal of the box around the border line that each point is on.
    """

    points: Array
    width: Array

    def wider(self, smallest: float) -> Array:
        """Return the points on border lines at least `smallest` wide."""
        return self.points[self.width >= smallest]


def _line_widths(points: Array, links: Indices) -> tuple[Array, Indices]:
    """Return, per point, the bounding box diagonal of its connected component and the number of points in it."""
    n = len(points)
    graph = coo_array((np.ones(len(links), bool), links.T.reshape(2, -1)), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, points)
    np.maximum.at(high, label, points)
    return norm(high - low)[label], np.bincount(label, minlength=count)[label]


def border_of_triangles(vertices: Array, faces: Indices, sides: Mask) -> Border:
    """Return the border of a surface, as points along its edges no farther apart than 1/300 of its diagonal."""
    edges = np.stack([faces[sides], np.roll(faces, -1, axis=1)[sides]], axis=1)
    if not len(edges):
        return Border(np.zeros((0, 3)), np.zeros(0))
    width, _ = _line_widths(vertices, edges)
    a, b = vertices[edges[:, 0]], vertices[edges[:, 1]]
    step = float(norm(np.ptp(vertices, axis=0))) / 300
    pieces = np.maximum(np.ceil(norm(b - a) / step), 1).astype(np.int64)
    row = np.repeat(np.arange(len(edges)), pieces)
    part = (np.arange(len(row)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[row]
    return Border(a[row] + part[:, None] * (b - a)[row], width[edges[row, 0]])


def border_of_points(points: Array) -> Border:
    """Return the border points of a cloud: those whose neighbors, in the tangent plane, are on one side."""
    if len(points) > MAX_POINTS:
        points = points[np.random.default_rng(0).choice(len(points), MAX_POINTS, replace=False)]
    points = subsampled(points)
    k = min(NEIGHBORS, len(points) - 1)
    if k < 3:
        return Border(np.zeros((0, 3)), np.zeros(0))
    tree = cKDTree(points)
    distance, near = tree.query(points, k=k + 1, workers=-1)
    others = np.ascontiguousarray(near[:, 1:])
    normals = fitted(points, others)[0]
    on = np.flatnonzero(_are_one_sided(points[others] - points[:, None], normals))
    # at steps in sampling density the nearest neighbors are one-sided too: confirm with more of them
    _, more = tree.query(points[on], k=min(4 * k, len(points) - 1) + 1, workers=-1)
    on = on[_are_one_sided(points[more[:, 1:]] - points[on, None], normals[on])]
    if not len(on):
        return Border(np.zeros((0, 3)), np.zeros(0))
    ends, reach = points[on], 1.5 * distance[on, min(8, k)]
    pairs = cKDTree(ends).query_pairs(float(np.quantile(reach, 0.9)), output_type="ndarray").astype(np.int64)
    apart = norm(ends[pairs[:, 0]] - ends[pairs[:, 1]])
    pairs = pairs[apart <= reach[pairs].max(axis=1)]
    width, count = _line_widths(ends, pairs)
    kept = count >= MIN_POINTS
    return Border(ends[kept], width[kept])


def _are_one_sided(away: Array, normals: Array) -> Mask:
    """Return a mask (m,) of points whose neighbors, offsets (m, k, 3), are on one side in the plane of a normal."""
    gap, offset = boundary_criteria(away, normals)
    return (gap > MIN_ANGLE_GAP) & (offset > MIN_OFFSET)


def boundary_criteria(away: Array, normals: Array) -> tuple[Array, Array]:
    """Return the largest angle (m,) between neighbors, and the offset of their mean, relative to the farthest one."""
    x, y = (np.einsum("mki,mi->mk", away, axis) for axis in tangents(normals))
    angles = np.sort(np.arctan2(y, x), axis=1)
    gap = np.diff(angles, axis=1, append=angles[:, :1] + 2 * np.pi).max(axis=1)
    return gap, np.hypot(x.mean(axis=1), y.mean(axis=1)) / np.maximum(np.hypot(x, y).max(axis=1), 1e-300)
