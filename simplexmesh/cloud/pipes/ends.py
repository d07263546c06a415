"""Ends of chains: where their points end, also within a bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.vectors import dot
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.pipes.chain import Chain
from simplexmesh.cloud.pipes.refining import SUPERFLUOUS, cheaper, near_surface
from simplexmesh.cloud.pipes.tolerances import SHORT
from simplexmesh.cloud.pipes.tracing._kernels_tracing import STEP
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings

MOST_ANGLE = np.radians(170)
"""Of a bend at an end: at half a turn its corner is at infinity."""

BEYOND = 2
"""Points beyond an end, which may be strays."""


def with_ends(around: Surroundings, chain: Chain, deviation: float) -> Chain:
    """Return the chain with ends where its points end; short straights behind bends may become parts of those."""
    for _ in range(2):
        chain = reversed_chain(_ended(around, _without_stub(around, chain), deviation))
    return chain


def reversed_chain(chain: Chain) -> Chain:
    """Return a chain from its end to its start."""
    changes = chain.changes[::-1].copy()
    for row in changes:
        length = chain.lengths[int(row[0])]
        row[:] = len(chain.lengths) - 1 - row[0], length - row[2], length - row[1]
    return Chain(chain.corners[::-1], chain.bend_radii[::-1], chain.radii[::-1], changes)


def _ended(around: Surroundings, chain: Chain, deviation: float) -> Chain:
    """Return a chain that ends where its points do: on the last straight, or in the bend before."""
    at = near_surface(around, chain, max(WITHIN * deviation, 0.02 * around.radius))
    if len(at) < 10:
        return chain
    station = np.sort(chain.feet(around.points[at]).station)[-1 - BEYOND]
    bend_end = chain.stations[-2]
    if station < bend_end and len(chain.bend_radii) and station > chain.stations[-3]:
        return _bent(chain, (station - chain.stations[-3]) / chain.bend_radii[-1])
    corners = chain.corners.copy()
    corners[-1] += max(station - chain.stations[-1], bend_end - chain.stations[-1]) * chain.directions[-1]
    return replace(chain, corners=corners)


def _without_stub(around: Surroundings, chain: Chain) -> Chain:
    """Return a chain whose last bend takes the short straight behind it, if the points do not tell them apart."""
    stub = float(np.diff(chain.limits[-1])[0])
    if (
        not len(chain.bend_radii)
        or stub > SHORT * chain.radii[-1]
        or (chain.changes[:, 0] == len(chain.lengths) - 1).any()
    ):
        return chain
    more = (stub + STEP * chain.radii[-1]) / chain.bend_radii[-1]
    if chain.angles[-1] + more > MOST_ANGLE:
        return chain
    return cheaper(around, chain, _bent(chain, chain.angles[-1] + more), SUPERFLUOUS)


def _bent(chain: Chain, angle: float) -> Chain:
    """Return a chain that ends with its last bend, which turns by an angle from where it starts."""
    u, v, bend = chain.directions[-2], chain.directions[-1], chain.bend_radii[-1]
    across = v - dot(v, u) * u
    side = across / np.sqrt(dot(across, across))
    reach = bend * np.tan(angle / 2)
    corners = chain.corners.copy()
    corners[-2] += (reach - chain.reaches[-1]) * u
    corners[-1] = corners[-2] + reach * (1 + 1e-9) * (np.cos(angle) * u + np.sin(angle) * side)
    return replace(chain, corners=corners)
