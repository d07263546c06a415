"""Straights and bends of a traced axis: straight stretches, and where one bend cannot join two, one more between."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import cross, dot, norm, normalized
from simplexmesh.cloud.pipes.chain import Chain, chain_of
from simplexmesh.cloud.pipes.tolerances import LOOSE, MEETING, PARALLEL, SHORT, TRIED
from simplexmesh.cloud.pipes.tracing.tracking import Track
from simplexmesh.numerics.round_fits import between_axes

STRAIGHT = 0.03
"""Root mean square distance of traced places from the axis of a straight, in radii, as all lengths below."""

LEAVES = 0.12
"""Distance from the axis of the last straight at which the end of a track is a bend, until points tell otherwise."""


class Straight(NamedTuple):
    """A stretch of traced places, the first and the last, with a point and the direction of its axis."""

    first: int
    last: int
    point: Array
    direction: Array


def segmented(track: Track, radius: float) -> Chain:
    """Return the chain of straights and bends that a track follows."""
    points, directions = track.points / radius, track.directions
    straights = _long_stretches(points, directions)
    if not straights:
        k = len(points) // 2
        straights = [Straight(k, k, points[k], directions[k])]
    straights = _with_ends(straights, points, directions)
    k = 0
    while k < len(straights) - 1 and len(straights) < len(points):
        more = _between(straights[k], straights[k + 1], points, directions)
        if more is None:
            k += 1
        else:
            straights.insert(k + 1, more)
    return _chain(straights, points, radius)


def bend_between(one: Straight, other: Straight, points: Array) -> tuple[Array, float, float] | None:
    """Return corner and radius of the best bend between straights that meet, and how far places are off it."""
    u, v = one.direction, other.direction
    turn = float(np.arctan2(norm(cross(u, v)), u @ v))
    if turn < PARALLEL or turn > np.pi - PARALLEL:
        return None
    ahead, _, apart, across = between_axes(one.point, u, other.point, v)
    corner = one.point + ahead * u + 0.5 * apart * across
    start, end = (corner - points[one.first]) @ u, (points[other.last] - corner) @ v
    room = min(start, end) / np.tan(turn / 2)
    if abs(apart) > MEETING or room < 1:
        return None
    between = points[one.first : other.last + 1] - corner
    inward, onward = normalized(v - u), normalized(u + v)
    t, b, h = np.abs(between @ onward), between @ inward, between @ across
    radii = np.geomspace(1.0, room, TRIED)[:, None]
    depth = radii / np.cos(turn / 2)
    on_arc = np.arctan2(t, depth - b) < turn / 2
    off = np.where(on_arc, np.hypot(t, depth - b) - radii, t * np.sin(turn / 2) - b * np.cos(turn / 2))
    inner = slice(one.last - one.first, len(between) - (other.last - other.first))
    miss = np.sqrt((off**2 + h**2)[:, inner].mean(axis=1))
    whole = (np.minimum(off**2, 4 * LOOSE**2)).mean(axis=1)  # of the straights too, which a bend too wide would cut
    best = int(whole.argmin())
    return corner, float(radii[best, 0]), float(miss[best])


def _long_stretches(points: Array, directions: Array) -> list[Straight]:
    """Return stretches that are surely straight, the longest first found, in their order."""
    taken = np.zeros(len(points), bool)
    found: list[Straight] = []
    lasts = _farthest(points)
    while True:
        runs = [(norm(points[j] - points[i]), i, j) for i, j in enumerate(lasts) if not taken[i : j + 1].any()]
        length, i, j = max(runs, default=(0.0, 0, 0))
        if length < 2 * SHORT:
            return sorted(found, key=lambda straight: straight.first)
        taken[i : j + 1] = True
        found.append(_fitted(points, directions, i, j))
        for k in range(len(lasts)):
            if k < i <= lasts[k]:
                lasts[k] = i - 1


def _farthest(points: Array) -> list[int]:
    """Return for each place the last one to which the stretch from it is straight."""
    ones = np.concatenate([np.zeros((1, 3)), np.cumsum(points, axis=0)])
    twos = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(points[:, :, None] * points[:, None], axis=0)])
    lasts, j = [], 0
    for i in range(len(points)):
        j = max(i, j)
        while j + 1 < len(points):
            n = j + 2 - i
            mean = (ones[j + 2] - ones[i]) / n
            moments = np.linalg.eigvalsh((twos[j + 2] - twos[i]) / n - np.outer(mean, mean))
            if moments[0] + moments[1] > STRAIGHT**2:
                break
            j += 1
        lasts.append(j)
    return lasts


def _fitted(points: Array, directions: Array, first: int, last: int) -> Straight:
    """Return the straight through a stretch; through a short one with the mean of its directions."""
    part = points[first : last + 1]
    if norm(part[-1] - part[0]) < SHORT:
        return Straight(first, last, part.mean(axis=0), normalized(directions[first : last + 1].mean(axis=0)))
    axis = np.linalg.svd(part - part.mean(axis=0), full_matrices=False)[2][0]
    return Straight(first, last, part.mean(axis=0), axis * np.sign(axis @ (part[-1] - part[0])))


def _with_ends(straights: list[Straight], points: Array, directions: Array) -> list[Straight]:
    """Return straights that begin and end with the track: where that is bent, with the directions at its ends."""
    out, before, after = list(straights), straights[0].first, straights[-1].last + 1
    if _leaves(points[:before], straights[0]):
        out.insert(0, _fitted(points, directions, 0, _farthest(points[:before])[0]))
    if _leaves(points[after:], straights[-1]):
        lasts = _farthest(points[after:])
        out.append(_fitted(points, directions, after + lasts.index(lasts[-1]), len(points) - 1))
    return out


def _leaves(places: Array, straight: Straight) -> bool:
    """Whether some places are off the axis of a straight."""
    return bool((norm(cross(places - straight.point, straight.direction)) > LEAVES).any())


def _longest(points: Array, directions: Array, low: int, high: int) -> Straight:
    """Return the longest straight stretch among places."""
    firsts, lasts = np.arange(low, high + 1), np.array(_farthest(points[low : high + 1])) + low
    k = int(norm(points[lasts] - points[firsts]).argmax())
    return _fitted(points, directions, int(firsts[k]), int(lasts[k]))


def _between(one: Straight, other: Straight, points: Array, directions: Array) -> Straight | None:
    """Return a straight that is needed between two, None where one bend joins them, or nothing can."""
    low, high = one.last + 1, other.first - 1
    if high < low or _collinear(one, other, points):
        return None
    bend = bend_between(one, other, points)
    if bend is not None and bend[2] < LOOSE:
        return None
    run = _longest(points, directions, low, high)
    if norm(points[run.last] - points[run.first]) > 2 * SHORT:
        return run
    costs = []
    for k in range(low, high + 1):
        there = Straight(k, k, points[k], directions[k])
        halves = bend_between(one, there, points), bend_between(there, other, points)
        costs.append(sum(MEETING if half is None else half[2] for half in halves))
    k = low + int(np.argmin(costs))
    if bend is not None and costs[k - low] > bend[2]:
        return None
    return Straight(k, k, points[k], directions[k])


def _collinear(one: Straight, other: Straight, points: Array) -> bool:
    """Whether two straights are one, with all places between."""
    part = points[one.first : other.last + 1]
    turn = np.arccos(np.clip(one.direction @ other.direction, -1, 1))
    off = norm(cross(part - part.mean(axis=0), normalized(part[-1] - part[0])))
    return bool(turn < PARALLEL and np.sqrt((off**2).mean()) < LOOSE)


def _chain(straights: list[Straight], points: Array, radius: float) -> Chain:
    """Return the chain of straights, with the best bends between them."""
    corners, bends = [_onto(points[0], straights[0])], []
    for one, other in itertools.pairwise(straights):
        bend = bend_between(one, other, points)
        if bend is None:
            ends = points[one.last], points[other.first]
            bend = (ends[0] + ends[1]) / 2, 1.0, 0.0
        corners.append(bend[0])
        bends.append(bend[1])
    corners.append(_onto(points[-1], straights[-1]))
    return chain_of(radius * np.array(corners), radius * np.array(bends), radius).fitting()


def _onto(point: Array, straight: Straight) -> Array:
    """Return the nearest point on the axis of a straight."""
    out: Array = straight.point + dot(point - straight.point, straight.direction) * straight.direction
    return out
