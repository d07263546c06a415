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
from simplexmesh.numerics.plane_fits import planes, subsampled
from simplexmesh.orientation.poisson import oriented_indicator
from simplexmesh.orientation.propagation import propagated

NEIGHBORS = 20
"""Nearest points between which signs are propagated: of much noise 10 leave up to 20 % wrong, 20 at most 5 %."""

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


def outward_cloud(cloud: PointCloud, *, is_open: bool = False) -> PointCloud:
    """Return a cloud with its normals, or those of local planes, away from the centroid of its border.

    Points without normals that are not known to be open, and show no border, are taken to bound a solid.
    """
    points, normals = cloud.points, cloud.normals
    border = border_of_points(points).points
    center = (border if len(border) else points).mean(axis=0)
    if normals is None:
        normals = _propagated(points) if is_open or len(border) else _bounding(points, planes(points).normals)
    return replace(cloud, normals=-normals if are_inward(points, normals, center) else normals)


def _propagated(points: Array) -> Array:
    """Return unit normals (n, 3) with signs propagated between neighbors that are as far apart as their noise."""
    some = subsampled(points)
    found, k = planes(some), min(NEIGHBORS, len(some) - 1)
    near = cKDTree(found.places).query(found.places, k=k + 1, workers=-1)[1]
    normals = propagated(k * np.arange(len(some) + 1), near[:, 1:].ravel(), found.places, found.normals)
    return normals if some is points else normals[cKDTree(some).query(points, workers=-1)[1]]


def _bounding(points: Array, normals: Array) -> Array:
    """Return normals with signs such that they bound a solid."""
    some, most = points, 60_000  # more change no sign on a grid of 64 cells
    if len(points) > most:
        some = points[np.random.default_rng(0).choice(len(points), most, replace=False)]
    cell = float(np.ptp(points, axis=0).max()) / 64
    inward = oriented_indicator(some, planes(some), cell).at(points)[1]
    return np.where(dot(normals, inward)[:, None] > 0, -normals, normals)
