"""Which of its two sides a normal looks to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _vec
from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.normals import faces
from simplexmesh.surface.samples import Samples

Array = NDArray[np.float64]


def outward(samples: Samples, around: Neighborhoods) -> Array:
    """Return (c, 3) directions, one for each center, that its normal shall not look away from.

    Normals known beforehand, else the area-weighted normal of the faces. A bare cloud says nothing of its outside:
    there, and where faces have no normal, it is the direction from the middle of all points, which looks outward on
    convex bodies and anywhere on others; neighbors may disagree.
    """
    if samples.outward is not None:
        return samples.outward[around.centers]
    from_middle = samples.points[around.centers] - samples.points.mean(axis=0)
    if not samples.is_connected and not around.closed.any():
        return from_middle
    known = faces.estimate(samples, around, weighting="area")
    return np.where(known.reasons[:, None] == 0, known.normals, from_middle)


def turned(normals: Array, toward: Array) -> Array:
    """Return the normals with those reversed that look away from where they shall look."""
    return np.where(_vec.dot(normals, toward)[:, None] < 0, -normals, normals)
