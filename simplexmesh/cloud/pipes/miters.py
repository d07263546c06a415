"""Corners where two straights are cut aslant and joined without a bend: told from bends, and from branches at runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.vectors import norm
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.ends import LESS, reversed_chain, share_on
from simplexmesh.cloud.pipes.refining import SUPERFLUOUS, cheaper
from simplexmesh.cloud.pipes.tolerances import SHORT
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings

SEEN = 0.2
"""Share of the points of a straight up to a corner, below which there are none as far on the other side of it."""


def mitered(around: Surroundings, chain: Chain, deviation: float) -> Chain:
    """Return an open chain with miters in those corners where bends are tight, and points are on miters as well."""
    for k in np.flatnonzero(chain.are_tight):
        bends = chain.bend_radii.copy()
        bends[k] = 0.0
        tried = cheaper(around, chain, replace(chain, bend_radii=bends).fitting(), SUPERFLUOUS)
        chain = tried if tried is not chain and _is_miter(around, tried, deviation, int(k)) else chain
    return chain


def _is_miter(around: Surroundings, chain: Chain, deviation: float, k: int) -> bool:
    """Whether points up to a corner on both sides are on the two straights, and none where one would go on behind it.

    A run goes on where a branch of its width meets it.
    """
    feet, corner = chain.feet(around.points), chain.stations[2 * k + 1]
    r = float(chain.radii[0])
    half = r * float(np.tan(chain.angles[k] / 2)) + SHORT * r
    on = np.abs(feet.distance) < 2 * deviation
    before, after = (on & (feet.station > low) & (feet.station < low + half) for low in (corner - half, corner))
    least = LESS * share_on(feet, 0.0, chain.stations[-1], deviation)
    alike = all(share_on(feet, low, low + half, deviation) >= least for low in (corner - half, corner))
    behind = _behind(around, chain, deviation, k, half), _behind(around, reversed_chain(chain), deviation, -1 - k, half)
    return alike and all(SEEN * side.sum() > more for side, more in zip((before, after), behind, strict=True))


def _behind(around: Surroundings, chain: Chain, deviation: float, k: int, half: float) -> int:
    """Return how many points are on a straight gone on behind the corner at its end, past what the other one hides."""
    along, corner = chain.directions[: len(chain.angles)][k], chain.corners[1:-1][k]
    away = around.points - corner
    height, hidden = away @ along, half - SHORT * chain.radii[0]
    off = norm(away - height[:, None] * along) - chain.radii[0]
    return int(((np.abs(off) < 2 * deviation) & (height > hidden) & (height < hidden + half)).sum())
