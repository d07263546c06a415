"""Stray points: isolated ones so far from all others that they determine the extent of the data."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._vec import norm
from simplexmesh.data.points import PointCloud
from simplexmesh.errors import warn

CENTRAL = 0.005, 0.995
"""Quantiles of the coordinates between which the box of most points lies."""

FAR, WIDE = 2.0, 4.0
"""In diagonals of that box: distance from its center of a stray point, and the extent of data that has some."""

NEIGHBOR, ISOLATED = 6, 10.0
"""Rank of the neighbor, the point itself first, whose distance shows isolation, and that in medians."""

MOST = 0.01
"""Largest fraction of stray points."""


def without_stray_points(cloud: PointCloud) -> PointCloud:
    """Return the points without isolated ones far from all others, with a warning.

    A single one, such as an invalid sample at the origin of a map, would leave no resolution for the object.

    Examples
    --------
    >>> import warnings
    >>> import simplexmesh as sm
    >>> points = np.vstack([sm.sphere(10).vertices, [[1e6, 0, 0]]])
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore")
    ...     len(points), len(without_stray_points(PointCloud(points)).points)
    (2001, 2000)
    """
    points = cloud.points
    low, high = np.quantile(points, CENTRAL, axis=0)
    diagonal = float(norm(high - low))
    if len(points) <= 1 / MOST or float(norm(np.ptp(points, axis=0))) <= WIDE * diagonal:
        return cloud
    gaps = cKDTree(points).query(points, k=[NEIGHBOR], workers=-1)[0][:, 0]
    stray = (norm(points - (low + high) / 2) > FAR * diagonal) & (gaps > ISOLATED * np.median(gaps))
    count = int(np.count_nonzero(stray))
    if not 0 < count <= MOST * len(points):
        return cloud
    warn(f"left out {count:,} of {len(points):,} points, isolated and far from all others")
    return PointCloud(points[~stray], None if cloud.normals is None else cloud.normals[~stray])
