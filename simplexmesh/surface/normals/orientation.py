"""Orientation of normals: which of the two sides is outward."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _vec
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import faces
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def outward_directions(samples: Samples, around: Neighborhoods) -> Array:
    """Return (c, 3) directions, one per center, with which its outward normal makes at most a right angle.

    Known normals, else the area-weighted normal of the faces. In a cloud without normals, and where faces have none, it
    is the direction from the centroid of all points, outward on convex bodies but not on others, where neighbors may
    disagree.
    """
    if samples.outward is not None:
        return samples.outward[around.centers]
    from_centroid = samples.points[around.centers] - samples.points.mean(axis=0)
    if not samples.is_connected and not around.closed.any():
        return from_centroid
    known = faces.estimate(samples, around, weighting="area")
    return np.where(known.reasons[:, None] == 0, known.normals, from_centroid)


def oriented(normals: Array, directions: Array) -> Array:
    """Return the normals, reversed where the scalar product with `directions` is negative."""
    return np.where(_vec.dot(normals, directions)[:, None] < 0, -normals, normals)
