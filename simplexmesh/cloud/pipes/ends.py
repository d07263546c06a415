"""Ends of chains: where points end, also within a bend or in a corner, and whether something else begins there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.vectors import dot, norm, normalized, tangents
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.pipes.chain import MOST_ANGLE, Chain, Feet
from simplexmesh.cloud.pipes.line import PipeLine
from simplexmesh.cloud.pipes.refining import SUPERFLUOUS, cheaper, near_surface
from simplexmesh.cloud.pipes.tolerances import BAND, LOOSE, SEEN, SHORT, SLIGHT
from simplexmesh.cloud.pipes.tracing._kernels_tracing import STEP
from simplexmesh.cloud.pipes.tracing.prolonging import BEYOND, prolonged
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings

LAST_BENDS = np.geomspace(0.3, 3.0, 8)
"""Lengths of last bends that are tried, in radii; longer ones are traced."""

SHORT_END = 5.0
"""Length in radii of a last bend and what is behind it, at most, that may be none."""

LESS = 0.7
"""Share of the points near a part of a pipe that are on it, in that of others, below which it is not of the pipe."""

RIM = 0.5
"""Distance from the rim, along and outward, within which something begins, in radii."""

SECTORS, MUCH = 12, 0.4
"""Of the rim, and the share of those seen at which it must begin: floors and other pipes are beside a few."""

FEW = 0.15
"""Points that begin in a sector, as a share of those of the line, beside twice the outliers as far before the rim."""


def with_ends(around: Surroundings, chain: Chain, deviation: float, gap: float, *, bends: bool = False) -> Chain:
    """Return the chain with ends where its points end; short straights behind bends may become parts of those.

    With `bends` one more is looked for at each end, which also another diameter may look like.
    """
    for _ in range(2):
        chain = _with_last_bend(around, chain, deviation) if bends else chain
        chain = _without_false_bend(around, _without_stub(around, chain), deviation)
        chain = reversed_chain(_ended(around, chain, deviation, gap))
    return chain


def reversed_chain(chain: Chain) -> Chain:
    """Return a chain from its end to its start."""
    changes = chain.changes[::-1].copy()
    for row in changes:
        length = chain.lengths[int(row[0])]
        row[:] = len(chain.lengths) - 1 - row[0], length - row[2], length - row[1]
    return Chain(chain.corners[::-1], chain.bend_radii[::-1], chain.radii[::-1], changes, -chain.offsets[::-1])


def without_last_bend(chain: Chain) -> Chain | None:
    """Return a chain without its last bend and what is behind that, if it is short."""
    r, j = float(chain.radii[-1]), len(chain.lengths) - 1
    if not len(chain.bend_radii) or chain.stations[-1] - chain.stations[-3] > SHORT_END * r or j in chain.changes[:, 0]:
        return None
    corners = chain.corners[:-1].copy()
    corners[-1] -= chain.reaches[-1] * chain.directions[-2]
    return replace(chain, corners=corners, bend_radii=chain.bend_radii[:-1])


def without_bends(chain: Chain, which: Mask, place: Array) -> Chain:
    """Return the part of an open chain about a place near its axis, up to some of its bends (m - 2,)."""
    j, last = int(chain.feet(place[None]).piece[0] + 1) // 2, len(chain.lengths) - 1
    bends = np.arange(last)[which]
    first, last = max(bends[bends < j] + 1, default=0), min(bends[bends >= j], default=last)
    segments = chain.changes[:, 0]
    kept, before = (segments >= first) & (segments <= last), int((segments < first).sum())
    radii, changes = chain.radii[before : before + kept.sum() + 1], chain.changes[kept] - np.array([first, 0.0, 0.0])
    return Chain(chain.corners[first : last + 2], chain.bend_radii[first:last], radii, changes, chain.offsets[kept])


def _without_false_bend(around: Surroundings, chain: Chain, deviation: float) -> Chain:
    """Return a chain without its last bend if the points behind it are less on it, as those of a hopper or a head."""
    shorter = without_last_bend(chain)
    if shorter is None:
        return chain
    feet = chain.feet(around.points)
    start, end = chain.stations[-3], chain.stations[-1]
    false = share_on(feet, start, end, deviation) < LESS * share_on(feet, 0.0, start, deviation)
    return shorter if false else chain


def share_on(feet: Feet, start: float, end: float, deviation: float) -> float:
    """Return which share of the points near a part of a chain are on it: within two deviations."""
    part = (feet.station > start) & (feet.station < end) & (np.abs(feet.distance) < BAND * feet.radius)
    return float((np.abs(feet.distance[part]) < 2 * deviation).mean()) if part.any() else 1.0


def are_corners(around: Surroundings, chain: Chain, deviation: float) -> Mask:
    """Return which bends (m - 2,) are none: without room, or tight ones whose points are less on them than others."""
    feet, out = chain.feet(around.points), chain.are_short.copy()
    least = LESS * share_on(feet, 0.0, chain.stations[-1], deviation)
    for k in np.flatnonzero(chain.are_tight & (chain.angles > SLIGHT)):
        start, end = chain.stations[2 * k + 1 : 2 * k + 3]
        out[k] |= share_on(feet, start, end, deviation) < least
    return out


def mitered(around: Surroundings, chain: Chain, deviation: float) -> Chain:
    """Return an open chain with miters in corners where bends are tight, and points are clearly more on miters."""
    for k in np.flatnonzero(chain.are_tight):
        bends = chain.bend_radii.copy()
        bends[k] = 0.0
        tried = cheaper(around, chain, replace(chain, bend_radii=bends).fitting(), -SUPERFLUOUS)
        chain = tried if tried is not chain and _is_miter(around, tried, deviation, int(k)) else chain
    return chain


def _is_miter(around: Surroundings, chain: Chain, deviation: float, k: int) -> bool:
    """Whether points up to a corner on both sides are on the two straights, and none where one goes on behind it."""
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


def _ended(around: Surroundings, chain: Chain, deviation: float, gap: float) -> Chain:
    """Return a chain that ends where its points do: on the last straight, or in the bend before."""
    at = near_surface(around, chain, max(WITHIN * deviation, 0.02 * around.radius))
    if len(at) < 10:
        return chain
    station = np.sort(chain.feet(around.points[at]).station)[-1 - BEYOND]
    bend_end = chain.stations[-2]
    if station <= bend_end and chain.are_miters[-1:].any():
        return chain
    if station < bend_end and len(chain.bend_radii) and station > chain.stations[-3]:
        return _bent(chain, (station - chain.stations[-3]) / chain.bend_radii[-1])
    corners = chain.corners.copy()
    corners[-1] += max(station - chain.stations[-1], bend_end - chain.stations[-1]) * chain.directions[-1]
    return prolonged(around, replace(chain, corners=corners), deviation, gap)


def _without_stub(around: Surroundings, chain: Chain) -> Chain:
    """Return a chain whose last bend takes the short straight behind it, if the points do not tell them apart."""
    stub = float(np.diff(chain.limits[-1])[0])
    if (
        not len(chain.bend_radii)
        or chain.are_miters[-1]
        or stub > SHORT * chain.radii[-1]
        or (chain.changes[:, 0] == len(chain.lengths) - 1).any()
    ):
        return chain
    more = (stub + STEP * chain.radii[-1]) / chain.bend_radii[-1]
    if chain.angles[-1] + more > MOST_ANGLE:
        return chain
    return cheaper(around, chain, _bent(chain, chain.angles[-1] + more), SUPERFLUOUS)


def _with_last_bend(around: Surroundings, chain: Chain, deviation: float) -> Chain:
    """Return a chain with one more bend at its end if that straight, too short to be traced, leaves its points."""
    r, along, room = float(chain.radii[-1]), chain.directions[-1], float(np.diff(chain.limits[-1])[0])
    if (chain.changes[:, 0] == len(chain.lengths) - 1).any():
        room = min(room, chain.lengths[-1] - chain.changes[-1, 2])
    feet = chain.feet(around.points[near_surface(around, chain, BAND * around.radius)])
    frame = np.stack(tangents(along))
    height, out = feet.station - chain.stations[-1], feet.normal @ frame.T
    heavy = out / (1 + (feet.distance / (LOOSE * r)) ** 2)[:, None] ** 2
    best, length, curvature = 0.0, 0.0, np.zeros(2)
    for tried in r * LAST_BENDS[LAST_BENDS * r < room - r]:
        sag = np.maximum(height + tried, 0) ** 2 / 2
        right = heavy.T @ (sag * feet.distance)
        found = np.linalg.solve((heavy * sag[:, None] ** 2).T @ out + 1e-12 * r**4 * np.eye(2), right)
        gain = found @ right / deviation**2 - SUPERFLUOUS * np.log(max((sag > 0).sum(), 1))
        if gain > best:
            best, length, curvature = float(gain), float(tried), found
    if not length:
        return chain
    bend = max(1 / float(norm(curvature)), r)
    corners = np.append(chain.corners, chain.corners[-1:], axis=0)
    corners[-2] += (bend * np.tan(length / bend / 2) - length) * along
    corners[-1] = corners[-2] + r * (
        np.cos(length / bend) * along + np.sin(length / bend) * normalized(curvature @ frame)
    )
    longer = replace(chain, corners=corners, bend_radii=np.append(chain.bend_radii, bend))
    # three times the price: a wall beside the end looks like a bend too
    return cheaper(around, chain, _bent(longer, length / bend), -3 * SUPERFLUOUS)


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


def with_stops(line: PipeLine, tree: cKDTree, origin: Array) -> PipeLine:
    """Return a line that says at which ends something wider begins; the tree is of the whole cloud, less an origin."""
    start, end = (
        "obstacle" if stop == "end" and _begins(line, tree, line.chain.corners[k] - origin, k) else stop
        for k, stop in zip((0, -1), line.stops, strict=True)
    )
    return replace(line, stops=(start, end))


def _begins(line: PipeLine, tree: cKDTree, end: Array, k: int) -> bool:
    """Whether outside of much of the rim at the first or last corner there are more points than outliers before it."""
    along, r = line.chain.directions[k] * (1 if k else -1), line.elements[k].radius
    near = np.array(tree.query_ball_point(end, r * np.hypot(3 * RIM, 1 + RIM)), dtype=np.int64)
    away = np.asarray(tree.data)[near] - end
    height, (x, y) = away @ along / (RIM * r), (away @ axis for axis in tangents(along))
    beyond = np.hypot(x, y) / r - 1
    own, at_rim = line.labels[near] >= 0, np.abs(height) < 1
    wider = ~own & (beyond > BAND / 2) & (beyond < RIM)
    before = wider & (height > -3) & (height < -1)
    sector = ((np.arctan2(y, x) / (2 * np.pi) + 0.5) * SECTORS).astype(np.int64) % SECTORS
    seen, begun = (np.bincount(sector[some & at_rim], minlength=SECTORS) for some in (own, wider))
    level = FEW * seen[seen > 0].mean() + 2 * before.sum() / SECTORS if seen.any() else np.inf
    return bool((begun[seen > 0] > level).sum() > MUCH * (seen > 0).sum())
