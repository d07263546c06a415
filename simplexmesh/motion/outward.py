"""Which way open data looks, when a closed start comes to it from outside."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import dot, norm
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.motion.initial.orientation import turned
from simplexmesh.motion.initial.planes import planes
from simplexmesh.motion.subjects import PointsSubject, Subject, TrianglesSubject
from simplexmesh.motion.targets.borders import border_of_points

Array = NDArray[np.float64]

CELLS = 64
MOST_POINTS = 60_000
STRAIGHT = 0.05


def turned_outward(subject: Subject) -> Subject:
    """Return the subject with normals that look away from the middle of its border, as a sphere around it sees them.

    A mesh that comes from outside must not be drawn to the inner side of a shell. Points without normals get some:
    those of the planes through their neighbors, turned so that together they bound a body as well as they can.
    Volumes and closed surfaces know their outside and stay as they are.
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
    if cloud.normals is None:
        cloud = PointCloud(cloud.points, _normals(cloud.points))
    assert cloud.normals is not None
    border = border_of_points(cloud.points)
    middle = border.points.mean(axis=0) if len(border.points) else cloud.points.mean(axis=0)
    if sense(cloud.points, cloud.normals, middle) < -STRAIGHT:
        cloud = PointCloud(cloud.points, -cloud.normals)
    return PointsSubject(cloud, subject.components)


def sense(points: Array, normals: Array, middle: Any) -> float:
    """Return -1 to 1: whether normals look away from a middle (positive) or towards it, in the mean over the area.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4)
    >>> round(sense(ball.vertices, -ball.normals, np.zeros(3)), 2)
    -1.0
    """
    away = points - middle
    whole = float((norm(away) * norm(normals)).sum())
    return float(dot(away, normals).sum()) / max(whole, 1e-300)


def _normals(points: Array) -> Array:
    """Return a unit normal at each point, turned alike."""
    most = points
    if len(points) > MOST_POINTS:
        most = points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]
    cell = float(np.ptp(points, axis=0).max()) / CELLS
    inward = turned(most, planes(most), cell).at(points)[1]
    found = planes(points).normals
    return np.where(dot(found, inward)[:, None] > 0, -found, found)
