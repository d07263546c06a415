"""Orientation of open data whose start encloses it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from simplexmesh._vec import dot, norm
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.motion.initial.orientation import oriented_indicator
from simplexmesh.motion.initial.planes import planes
from simplexmesh.motion.subjects import PointsSubject, Subject, TrianglesSubject
from simplexmesh.motion.targets.borders import border_of_points

Array = NDArray[np.float64]

CELLS = 64
"""Grid cells along the longest side of the bounding box."""

MOST_POINTS = 60_000
"""Points used to orient normals on the grid."""

NEIGHBORS = 10

STRAIGHT = 0.05
"""Magnitude of `sense` below which data is too flat to have an outer side."""


def turned_outward(subject: Subject, *, enclosed: bool = True) -> Subject:
    """Return the subject with normals that point away from the centroid of its border.

    A mesh that encloses the data must not be attracted to the inner side of a shell. Points without normals get those
    of local planes, with signs propagated from point to point if the data has a border, else such that they bound a
    solid. If the start does not enclose them they get none: it is close to them, and without orientation more of them
    are found along its normals. Volumes and closed surfaces have an outside and are returned unchanged.

    Parameters
    ----------
    subject : Subject
    enclosed : bool
        Whether the start encloses the data; points without normals then need them.

    Returns
    -------
    Subject
    """
    if isinstance(subject, TrianglesSubject):
        border, triangles = subject.target.border, subject.triangles  # type: ignore[attr-defined]
        if not len(border.points):
            return subject
        centers = triangles.vertices[triangles.faces].mean(axis=1)
        if sense(centers, triangles.face_vectors, border.points.mean(axis=0)) >= -STRAIGHT:
            return subject
        return TrianglesSubject(TriangleMesh(triangles.vertices, triangles.faces[:, ::-1]), subject.components)
    if not isinstance(subject, PointsSubject):
        return subject
    cloud = subject.cloud
    if cloud.normals is None and not enclosed:
        return subject
    border = border_of_points(cloud.points)
    center = border.points.mean(axis=0) if len(border.points) else cloud.points.mean(axis=0)
    normals = cloud.normals
    if normals is None:
        found = planes(cloud.points).normals
        normals = propagated(cloud.points, found, center) if len(border.points) else _bounding(cloud.points, found)
    if sense(cloud.points, normals, center) < -STRAIGHT:
        normals = -normals
    return PointsSubject(PointCloud(cloud.points, normals), subject.components)


def sense(points: Array, normals: Array, center: Any) -> float:
    """Return the weighted mean cosine, -1 to 1, between normals and the directions away from a center.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4)
    >>> round(sense(ball.vertices, -ball.normals, np.zeros(3)), 2)
    -1.0
    """
    away = points - center
    whole = float((norm(away) * norm(normals)).sum())
    return float(dot(away, normals).sum()) / max(whole, 1e-300)


def propagated(points: Array, normals: Array, center: Array) -> Array:
    """Return normals with consistent signs between neighbors, each component pointing away from a center on average.

    Signs are propagated along the minimum spanning tree of the angles between neighboring normals. Unlike orientation
    by a solid, this works for thin sheets.

    Parameters
    ----------
    points, normals : (n, 3) array of float
        Unit normals of either sign.
    center : (3,) array of float

    References
    ----------
    H. Hoppe, T. DeRose, T. Duchamp, J. McDonald, W. Stuetzle, Surface reconstruction from unorganized points,
    SIGGRAPH 1992, section 3.3.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(8)
    >>> mixed = ball.normals * np.random.default_rng(0).choice([-1, 1], ball.n_vertices)[:, None]
    >>> bool(np.allclose(propagated(ball.vertices, mixed, np.zeros(3)), ball.normals))
    True
    """
    n, k = len(points), min(NEIGHBORS, len(points) - 1)
    _, near = cKDTree(points).query(points, k=k + 1, workers=-1)
    a, b = np.repeat(np.arange(n), k), near[:, 1:].ravel()
    turn = 1.0 + 1e-6 - np.abs(dot(normals[a], normals[b]))
    tree = minimum_spanning_tree(csr_array((turn, (a, b)), shape=(n, n)))
    tree = tree + tree.T
    count, piece = connected_components(tree, directed=False)
    out = normals.copy()
    for start in np.unique(piece, return_index=True)[1].tolist():
        order, before = breadth_first_order(tree, start, directed=False)
        for row in order[1:].tolist():
            if out[row] @ out[before[row]] < 0:
                out[row] *= -1
    away = np.bincount(piece, dot(out, points - center), minlength=count)
    return np.where(away[piece, None] < 0, -out, out)


def _bounding(points: Array, normals: Array) -> Array:
    """Return normals with signs such that they bound a solid."""
    some = points
    if len(points) > MOST_POINTS:
        some = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
    cell = float(np.ptp(points, axis=0).max()) / CELLS
    inward = oriented_indicator(some, planes(some), cell).at(points)[1]
    return np.where(dot(normals, inward)[:, None] > 0, -normals, normals)
