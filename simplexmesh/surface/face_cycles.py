"""Neighborhoods for the estimators that read the faces around a vertex."""

from __future__ import annotations

import numpy as np

from simplexmesh.surface.neighborhoods import Neighborhoods
from simplexmesh.surface.sampled_surface import SampledSurface


def simplex_neighbors(samples: SampledSurface) -> Neighborhoods | None:
    """Return the three neighbors of each vertex of a simplex mesh, None for anything else."""
    ring = samples.links
    return ring if ring is not None and (ring.valence == 3).all() else None


def face_cycles(samples: SampledSurface, around: Neighborhoods, method: str) -> Neighborhoods:
    """Return the cycles of neighbors around the centers, those given or the one-rings; refuse anything else."""
    if samples.faces is None and (simplex_neighbors(samples) is not None or not around.closed.any()):
        raise ValueError(f"surface must be triangles for method {method!r}, not points or a simplex mesh")
    if around.closed.any():
        return around
    return one_rings(samples, around, method)


def one_rings(samples: SampledSurface, around: Neighborhoods, method: str) -> Neighborhoods:
    """Return the ordered one-rings around the centers; refuse other neighborhoods."""
    if around is samples.one_ring:
        return around
    ring = samples.one_ring.taken(around.centers)
    if not _same(ring, around):
        raise ValueError(f"neighborhood must be rings(1) for method {method!r}, which reads the faces around a vertex")
    return ring


def _same(one: Neighborhoods, other: Neighborhoods) -> bool:
    """Return whether both have the same neighbors, in any order."""
    if not np.array_equal(one.offsets, other.offsets):
        return False
    if np.array_equal(one.members, other.members):
        return True
    rows = np.repeat(np.arange(len(one)), one.valence)
    first, second = (made.members[np.lexsort((made.members, rows))] for made in (one, other))
    return np.array_equal(first, second)
