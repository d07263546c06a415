"""Whether the normals of points can be believed."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh.data.points import PointCloud
from simplexmesh.errors import warn

LEAST_AGREEMENT = 0.75
"""Normals of which fewer agree with those of their neighbors say nothing about inside and outside."""


def with_sound_normals(cloud: PointCloud) -> PointCloud:
    """Return the cloud, without its normals where those of neighboring points contradict each other."""
    if cloud.normals is None:
        return cloud
    some = np.linspace(0, len(cloud.points) - 1, min(len(cloud.points), 2000)).astype(int)
    _, near = cKDTree(cloud.points).query(cloud.points[some], k=min(5, len(cloud.points)))
    agree = np.einsum("ij,ikj->ik", cloud.normals[some], cloud.normals[near[:, 1:]]) > 0
    if agree.mean() > LEAST_AGREEMENT:
        return cloud
    share = f"{1 - agree.mean():.0%}"
    warn(f"normals of neighboring points contradict each other ({share}); they were left out")
    return PointCloud(cloud.points)
