"""Rings of faces for the estimators that read them."""

from __future__ import annotations

import numpy as np

from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.samples import Samples


def three_each(samples: Samples) -> Neighborhoods | None:
    """Return the three neighbors of each vertex of a simplex mesh; None of anything else."""
    ring = samples.links
    if samples.faces is not None or ring is None or len(ring) != len(samples.points):
        return None
    return ring if (ring.valence == 3).all() else None


def ringed(samples: Samples, around: Neighborhoods, method: str) -> Neighborhoods:
    """Return the cycles of faces around the centers; neighborhoods given as cycles are taken as they are.

    Raises
    ------
    ValueError
        No triangles and no cycles given, or neighborhoods other than the one-ring.
    """
    if samples.faces is None and (three_each(samples) is not None or not around.closed.any()):
        raise ValueError(f"surface must be triangles for method {method!r}, not points or a simplex mesh")
    if around.closed.any():
        return around
    return faces_around(samples, around, method)


def faces_around(samples: Samples, around: Neighborhoods, method: str) -> Neighborhoods:
    """Return the one-rings around the centers, in order.

    Raises
    ------
    ValueError
        The neighborhoods are others.
    """
    if around is samples.one_ring:
        return around
    ring = samples.one_ring.taken(around.centers)
    if not _same(ring, around):
        raise ValueError(f"neighborhood must be rings(1) for method {method!r}, which reads the faces around a vertex")
    return ring


def _same(one: Neighborhoods, other: Neighborhoods) -> bool:
    """Whether both have the same neighbors, in whatever order."""
    if not np.array_equal(one.offsets, other.offsets):
        return False
    if np.array_equal(one.members, other.members):
        return True
    rows = np.repeat(np.arange(len(one)), one.valence)
    first, second = (made.members[np.lexsort((made.members, rows))] for made in (one, other))
    return np.array_equal(first, second)
