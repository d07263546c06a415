"""A consistency check of the normals of point clouds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.errors import warn
from simplexmesh.data.points import PointCloud

LEAST_AGREEMENT = 0.75
"""Share of neighboring normals within 90 degrees: with fewer, normals do not tell inside from outside."""


def with_consistent_normals(cloud: PointCloud) -> PointCloud:
    """Return the cloud, without normals and with a warning if those of neighboring points contradict each other."""
    if cloud.normals is None:
        return cloud
    some = np.linspace(0, len(cloud.points) - 1, min(len(cloud.points), 2000)).astype(int)
    _, near = cKDTree(cloud.points).query(cloud.points[some], k=min(5, len(cloud.points)))
    agree = np.einsum("ij,ikj->ik", cloud.normals[some], cloud.normals[near[:, 1:]]) > 0
    if agree.mean() > LEAST_AGREEMENT:
        return cloud
    share = f"{1 - agree.mean():.0%}"
    warn(f"normals of neighboring points contradict each other ({share}); they were left out")
    return replace(cloud, normals=None)
