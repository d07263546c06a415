"""What tells lines that nobody picked from walls, beams and square bars."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import tangents
from simplexmesh.cloud.pipes.chain import Chain

SECTORS = 24
"""Around the axis, of 15 degrees: sides of square bars fill three or four."""

ALIKE_ALL_AROUND = 0.2
"""Share of the variance of distances that is between sectors, at most: of square bars and beams it is more."""

OUT_OF_ROUND = 0.03
"""In radii: root mean square of what is between sectors, of oval pipes and stations apart; square bars have 0.07."""


def is_peaked(distance: Array, deviation: float) -> bool:
    """Return whether most distances are of the surface, not of what is as dense beside it: two deviations are near."""
    off = np.abs(distance) / (2 * deviation)
    near = int((off < 1).sum())
    beside = (len(off) - near) / (off.max(initial=2.0) - 1)
    return 2 * (near - beside) > len(off)


def is_round(chain: Chain, points: Array) -> bool:
    """Return whether points are off the straights of a chain by chance, not on the same sides of them all along."""
    feet = chain.feet(points)
    across = np.stack([np.stack(tangents(along)) for along in chain.directions])[feet.piece // 2]
    x, y = np.einsum("nki,ni->kn", across, feet.normal)
    sector = np.floor((np.arctan2(y, x) / (2 * np.pi) + 0.5) * SECTORS).astype(np.int64) % SECTORS
    group = np.unique(feet.piece * SECTORS + sector, return_inverse=True)[1].ravel()
    straight = feet.piece % 2 == 0
    group, distance = group[straight], feet.distance[straight]
    counts, sums = np.bincount(group), np.bincount(group, distance)
    between = (sums**2 / np.maximum(counts, 1)).sum() - (counts > 0).sum() * distance.var()
    whole = (distance**2).sum()
    return bool(between <= max(ALIKE_ALL_AROUND * whole, len(distance) * (OUT_OF_ROUND * chain.radii.min()) ** 2))
