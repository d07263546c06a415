"""The door of all that takes a cloud of points."""

from __future__ import annotations

from typing import Any

from simplexmesh._base import checks
from simplexmesh.data.conversion import given_points
from simplexmesh.data.points import PointCloud, warn_of_steps


def given_cloud(value: Any) -> PointCloud:
    """Return a cloud with all the points given, duplicates too, which are labeled as well; warn of coarse ones."""
    cloud = given_points(value, "cloud")
    if len(cloud):
        checks.size("cloud", cloud.bounds)
    warn_of_steps(cloud.points)
    return cloud
