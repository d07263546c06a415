"""Stray points: isolated ones so far from all others that they determine the extent of the data."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.errors import warn
from simplexmesh._base.vectors import norm
from simplexmesh.data.points import PointCloud

MOST = 0.01
"""Largest fraction of stray points: more of them are a part of the object."""


def without_stray_points(cloud: PointCloud) -> PointCloud:
    """Return the points without isolated ones two diagonals or more from the center of all but 1 %, with a warning."""
    points = cloud.points
    low, high = np.quantile(points, [MOST / 2, 1 - MOST / 2], axis=0)
    diagonal = float(norm(high - low))
    if len(points) <= 1 / MOST or float(norm(np.ptp(points, axis=0))) <= 4 * diagonal:
        return cloud
    gaps = cKDTree(points).query(points, k=[6], workers=-1)[0][:, 0]
    stray = (norm(points - (low + high) / 2) > 2 * diagonal) & (gaps > 10 * np.median(gaps))
    count = int(np.count_nonzero(stray))
    if not 0 < count <= MOST * len(points):
        return cloud
    warn(f"left out {count:,} of {len(points):,} points, isolated and far from all others")
    return PointCloud(points[~stray], None if cloud.normals is None else cloud.normals[~stray])
