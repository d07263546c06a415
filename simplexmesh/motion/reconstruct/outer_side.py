"""Open data: how wide its border is, and which side is its outside: the one away from the centroid of its border.

A mesh that encloses the data must not be attracted to the inner side of a shell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm
from simplexmesh.data.points import PointCloud
from simplexmesh.motion.targets.borders import border_of_points
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.numerics.plane_fits import planes
from simplexmesh.orientation.poisson import oriented_indicator
from simplexmesh.orientation.propagation import propagated

STRAIGHT = 0.05
"""Mean cosine below which data is too flat to have an outer side: it keeps the side that it has."""


def border_width(target: Target, points: Array) -> float:
    """Return the width of the widest border of the data, in diagonals of its points; 0 without any."""
    border = getattr(target, "border", None)
    return 0.0 if border is None else float(border.width.max(initial=0.0) / norm(np.ptp(points, axis=0)))


def are_inward(points: Array, normals: Array, center: Array) -> bool:
    """Return whether normals (n, 3) point towards a center (3,), by their mean cosine, weighted by sizes."""
    away = points - center
    return bool(dot(away, normals).sum() < -STRAIGHT * (norm(away) * norm(normals)).sum())


def outward_cloud(cloud: PointCloud) -> PointCloud:
    """Return a cloud with its normals, or those of local planes, away from the centroid of its border."""
    points, normals = cloud.points, cloud.normals
    border = border_of_points(points).points
    center = (border if len(border) else points).mean(axis=0)
    if normals is None:
        normals = planes(points).normals
        normals = _propagated(points, normals) if len(border) else _bounding(points, normals)
    return replace(cloud, normals=-normals if are_inward(points, normals, center) else normals)


def _propagated(points: Array, normals: Array) -> Array:
    """Return unit normals (n, 3) with signs propagated between the ten nearest points."""
    k = min(10, len(points) - 1)
    _, near = cKDTree(points).query(points, k=k + 1, workers=-1)
    return propagated(k * np.arange(len(points) + 1), near[:, 1:].ravel(), points, normals)


def _bounding(points: Array, normals: Array) -> Array:
    """Return normals with signs such that they bound a solid."""
    some, most = points, 60_000  # more change no sign on a grid of 64 cells
    if len(points) > most:
        some = points[np.random.default_rng(0).choice(len(points), most, replace=False)]
    cell = float(np.ptp(points, axis=0).max()) / 64
    inward = oriented_indicator(some, planes(some), cell).at(points)[1]
    return np.where(dot(normals, inward)[:, None] > 0, -normals, normals)
