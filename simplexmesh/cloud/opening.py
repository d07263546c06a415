"""The door of all that takes a cloud of points, and tells how far it is."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.progress import Report, reporting
from simplexmesh.data.conversion import as_points
from simplexmesh.data.points import PointCloud

COARSE = 1e-4
"""Steps of coordinates, in the extent of the cloud, that are told: in a plant of ten meters a millimeter."""

SOME = 1000
"""Points whose digits are looked at."""


def opened(value: Any) -> PointCloud:
    """Return a cloud with all the points given, duplicates too, which are labelled as well; warn of coarse ones."""
    cloud = value
    if isinstance(value, np.ndarray) and value.ndim == 2 and value.shape[1] in (3, 6):
        cloud = PointCloud(value[:, :3])
    elif not isinstance(value, PointCloud):
        cloud = as_points(value, "cloud")
    if len(cloud):
        checks.size("cloud", cloud.bounds)
    warn_of_steps(cloud.points)
    return cloud


def shown(progress: Any) -> AbstractContextManager[Report]:
    """Return what yields a function to report progress to, or say what progress must be."""
    return reporting(progress if callable(progress) else checks.flag("progress", progress))


def warn_of_steps(points: Array) -> None:
    """Warn if points (n, 3) have been 32-bit numbers far from the origin, which has put them on a coarse grid."""
    if not len(points):
        return
    extent = float(np.ptp(points, axis=0).max())
    few = points[:: -(-len(points) // SOME)]
    with np.errstate(all="ignore"):
        step = float(np.spacing(np.float32(np.abs(points).max())))
        coarse = step > COARSE * extent and (few == few.astype(np.float32)).all() and (few % (16 * step)).any()
    if coarse:
        warn(
            f"the points are on a grid of {step:g}, as 32-bit numbers are so far from the origin: "
            "shift them to it before they are stored as such"
        )
