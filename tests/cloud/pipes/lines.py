"""Random pipe lines: their true chain, and points as a scanner sees them, with gaps, a wall and a floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh.cloud.pipes.chain import Chain, chain_of
from simplexmesh.data.primitives import Torus


@dataclass
class Line:
    """What was drawn: points, the pick, the chain, and for each point whether it is of the pipe."""

    points: np.ndarray
    pick: np.ndarray
    chain: Chain
    on_pipe: np.ndarray


def random_chain(rng, bends=6, radius=1.0, ratios=(1.25, 10.0), straights=(3.0, 12.0)):
    """A chain whose parts stay clear of each other."""
    while True:
        directions = [unit(rng.normal(size=3))]
        bend_radii = radius * np.exp(rng.uniform(*np.log(ratios), bends))
        angles = np.radians(rng.choice([30, 45, 60, 90, 90, 90], bends) + rng.uniform(-2, 2, bends))
        for angle in angles:
            side = unit(np.cross(directions[-1], rng.normal(size=3)))
            directions.append(np.cos(angle) * directions[-1] + np.sin(angle) * side)
        reaches = bend_radii * np.tan(angles / 2)
        lengths = radius * rng.uniform(*straights, bends + 1) + np.append(0, reaches) + np.append(reaches, 0)
        corners = np.concatenate([np.zeros((1, 3)), np.cumsum(np.array(directions) * lengths[:, None], axis=0)])
        chain = chain_of(corners, bend_radii, radius)
        if clear(chain):
            return chain


def clear(chain, distance=3.5):
    """Whether parts far apart along the axis are far apart in space."""
    stations = np.arange(0, chain.stations[-1], 0.5 * chain.radii[0])
    axis = chain.at(stations)[0]
    apart = np.linalg.norm(axis[:, None] - axis[None], axis=2)
    along = np.abs(stations[:, None] - stations[None])
    return bool((apart[along > 3 * distance * chain.radii[0]] > distance * chain.radii[0]).all())


def unit(v):
    return v / np.linalg.norm(v)


def sampled(chain, rng, density=40.0, noise=0.01, view=None, arc=360.0):
    """Points on a chain, their stations; `density` points a squared radius, those seen within an arc about a view."""
    r = float(chain.radii.max())
    length = chain.stations[-1]
    count = int(density * 2 * np.pi * length / r)
    s, turn = rng.uniform(0, length, count), rng.uniform(0, 2 * np.pi, count)
    axis, along = chain.at(s)
    first = np.cross(along, unit(rng.normal(size=3)))
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(along, first)
    out = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    radius = chain.feet(axis).radius
    keep = np.ones(count, bool)
    if view is not None:
        keep = out @ view > np.cos(np.radians(arc / 2))
    points = axis + (radius + noise * r * rng.normal(size=count))[:, None] * out
    return points[keep], s[keep]


def random_line(
    seed, *, bends=6, noise=0.01, arc=200.0, gaps=3, gap=5.0, walls=True, density=40.0, ratios=(1.25, 10.0)
):
    """A line of 2 bends + 1 elements; gaps of up to 5 radii hide no element wholly."""
    rng = np.random.default_rng(seed)
    chain = random_chain(rng, bends, ratios=ratios)
    points, s = sampled(chain, rng, density, noise, unit(rng.normal(size=3)), arc)
    for _ in range(gaps):
        points, s = with_gap(points, s, chain, rng, gap)
    straight = chain.feet(points).piece % 2 == 0
    pick = points[rng.choice(np.flatnonzero(straight))]
    on_pipe = np.ones(len(points), bool)
    if walls:
        more = walls_of(points, rng, density / 4)
        points, on_pipe = np.concatenate([points, more]), np.append(on_pipe, np.zeros(len(more), bool))
    return Line(points, pick, chain, on_pipe)


def with_gap(points, s, chain, rng, gap):
    """Without the points of a stretch, of which no element lies wholly inside."""
    starts, ends = chain.stations[:-1], chain.stations[1:]
    for _ in range(100):
        length = rng.uniform(0.2, 1) * gap * chain.radii[0]
        low = rng.uniform(0, chain.stations[-1] - length)
        seen = (s < low) | (s > low + length)
        parts = [(s >= a) & (s <= b) for a, b in zip(starts, ends, strict=True)]
        left = np.array([(part & seen).sum() / max(1, part.sum()) for part in parts])
        if (left > 0.4).all():
            return points[seen], s[seen]
    return points, s


def meeting(one, other):
    """How far the end of an element is from the start of the next one, and the sine between their axes there."""
    return np.linalg.norm(other.start - one.end), np.linalg.norm(
        np.cross(leaving(one, one.end), leaving(other, other.start))
    )


def leaving(element, place):
    """The direction of the axis of an element at its start or its end."""
    if isinstance(torus := element.primitive, Torus):
        return unit(np.cross(torus.axis, place - torus.center))
    return unit(element.end - element.start)


def walls_of(points, rng, density):
    """Points of a floor under and a wall beside points."""
    low, high = points.min(axis=0) - 1.0, points.max(axis=0) + 1.0
    out = []
    for axis in (1, 2):
        others = [k for k in range(3) if k != axis]
        area = np.prod((high - low)[others])
        sheet = rng.uniform(low, high, (int(min(density * area, 60_000)), 3))
        sheet[:, axis] = low[axis] + 0.75 + 0.01 * rng.normal(size=len(sheet))
        out.append(sheet)
    return np.concatenate(out)
