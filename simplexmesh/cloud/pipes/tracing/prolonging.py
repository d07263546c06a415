"""Ends of chains where points are too few to be traced: on goes a straight as far as they are on its surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.cloud.fitting.selection import DECISIVE
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.tolerances import BAND
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings

STRAY = 0.1
"""Share of the points on a pipe and in it that are not of its surface: between it and what is behind."""

BEYOND = 2
"""Points beyond an end, which may be strays."""


def prolonged(around: Surroundings, chain: Chain, deviation: float, gap: float) -> Chain:
    """Return an open chain that goes on straight at its end as far as points are on it rather than anywhere about it.

    It becomes no more than twice as long as its last straight, whose axis is not known farther, and points on it are no
    farther apart along it than a gap, in radii.
    """
    r, along = float(chain.radii[-1]), chain.directions[-1]
    height, off = _ahead(around, chain, max(float(np.diff(chain.limits[-1])[0]), gap * r))
    corners = chain.corners.copy()
    corners[-1] += _farthest(height / r, off / r, deviation / r, gap) * r * along
    return replace(chain, corners=corners)


def _ahead(around: Surroundings, chain: Chain, reach: float) -> tuple[Array, Array]:
    """Return heights, in their order, and distances from the surface of what is near a chain gone on, or in it."""
    r, along, end = float(chain.radii[-1]), chain.directions[-1], chain.corners[-1]
    places = end + np.arange(0, reach + r, r)[:, None] * along
    found = around.tree.query_ball_point(places, r * float(np.hypot(1, 1 + BAND)))
    away = around.points[np.unique(np.concatenate([np.asarray(each, np.int64) for each in found]))] - end
    height = away @ along
    off = norm(away - height[:, None] * along) - r
    fine = np.flatnonzero((height > 0) & (height < reach) & (off < BAND * r))
    fine = fine[np.argsort(height[fine], kind="stable")]
    return height[fine], off[fine]


def _farthest(height: Array, off: Array, deviation: float, gap: float) -> float:
    """Return up to where points are likelier on a surface than spread evenly over its section, 0 for none, in radii."""
    on = np.exp(-((off / deviation) ** 2) / 2) / (np.sqrt(2 * np.pi) * deviation)
    gain = np.log((1 - STRAY) * on * (1 + BAND) ** 2 / 2 + STRAY)
    seen = height[gain > 0]
    apart = np.diff(seen, prepend=0.0) > gap
    total = np.cumsum(gain[height < seen[apart.argmax()]] if apart.any() else gain)
    if len(total) <= BEYOND or total.max() < DECISIVE:
        return 0.0
    end = height[int(total.argmax())]
    return float(seen[seen <= end][-1 - BEYOND :][0])
