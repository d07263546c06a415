"""Whether shapes keep clear of each other, told by balls that cover them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial.distance import cdist


@lru_cache(64)
def filled(shape):
    """Balls that cover a pipe, bend, cone or sphere: centers (m, 3) and radii (m,)."""
    if shape.kind == "sphere":
        return shape.origin[None], np.array([shape.radius])
    if shape.kind == "torus":
        turn = np.linspace(*shape.extent[0], 9)
        spokes = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        half = shape.radius * (turn[1] - turn[0]) / 2
        return shape.origin + shape.radius * spokes @ shape.frame, np.full(9, np.hypot(shape.tube_radius, 1.1 * half))
    heights = np.linspace(*shape.extent[1], 33)
    wide = shape.radius if shape.kind == "cylinder" else heights * np.tan(shape.half_angle)
    half = (heights[1] - heights[0]) / 2
    return shape.origin + heights[:, None] * shape.axis, np.hypot(np.broadcast_to(wide, 33), half)


def apart(one, other, clearance):
    """Whether two shapes leave more than a clearance between them, for sure."""
    (a, inner), (b, outer) = filled(one), filled(other)
    return bool((cdist(a, b) - inner[:, None] - outer).min() > clearance)
