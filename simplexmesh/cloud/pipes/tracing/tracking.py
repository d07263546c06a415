"""Tracing the axis of a pipe of known radius: the points, moved inward along their normals by the radius, lie on it.

On straights and bends alike, whatever the bend radius; those of walls and of other pipes do not gather. This is the
propagation of Chaperon (2002, 3.2) with its half-balls, stop tests and jumps over shadows, but on points of the axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from statistics import median
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import norm, normalized
from simplexmesh.cloud.pipes.tolerances import ALIKE, BAND, MEETING, SEEN, SHORT, SLIGHT
from simplexmesh.cloud.pipes.tracing import _kernels_tracing
from simplexmesh.cloud.pipes.tracing._kernels_tracing import STEP
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.data.primitives._kernels_profiles import framed
from simplexmesh.numerics.round_fits import between_axes

SPREAD = 0.05
"""Least eigenvalue of the normals' moments over their sum: that of an arc of 45 degrees; that of a wall is 0."""

JUMP = 5.0
"""Shadow that is jumped over (Chaperon 2002, 3.2.5)."""

BACK = 3
"""Steps before a shadow whose axis may go on behind it: the last ones are drawn from one side only."""

MOST_TURN = np.radians(110)
"""Of the direction across a shadow."""

MOST_GATHERED = 3000
"""Points behind a shadow that are looked at."""

CROSSING = 0.8
"""Distance from a place long passed at which a pipe would be in itself."""


class Step(NamedTuple):
    """A place on the axis."""

    point: Array
    direction: Array
    support: float  # points around it
    spread: float  # of their normals about the axis
    excess: float  # of the radius of the circle around it, over the radius foreseen


@dataclass
class Track:
    """Steps along the axis from one end to the other, and why it ends there."""

    steps: list[Step]
    stops: list[str] = field(default_factory=lambda: ["end", "end"])

    @property
    def closed(self) -> bool:
        """Whether it comes back to where it begins."""
        return self.stops == ["closed", "closed"]

    def begun(self, number: int) -> Track:
        """Return a closed track that begins at another step."""
        return Track([*self.steps[number:], *self.steps[:number]], self.stops)

    @property
    def points(self) -> Array:
        """(n, 3) on the axis."""
        return np.array([step.point for step in self.steps])

    @property
    def directions(self) -> Array:
        """(n, 3) along the axis."""
        return np.array([step.direction for step in self.steps])


def traced(around: Surroundings, known: list[Step], *, jump: float = JUMP) -> Track:
    """Return the track of a pipe both ways from known steps of it, or one way if that comes back to them."""
    onward, end = _followed(around, known.copy(), jump)
    if end == "closed" and norm(onward[-1].point - known[0].point) < 3 * STEP * around.radius:
        return Track(onward, [end, end])
    back, start = _followed(around, _turned(known), jump)
    return Track([*_turned(back[len(known) :]), *onward], [start, end])


def _turned(steps: Sequence[Step]) -> list[Step]:
    """Return steps from the last one to the first."""
    return [step._replace(direction=-step.direction) for step in reversed(steps)]


def along(around: Surroundings, point: Array, direction: Array, stretch: tuple[float, float]) -> list[Step]:
    """Return the steps on a stretch of an axis, between two heights about a point, where points gather."""
    r = around.radius
    places = point + np.arange(*stretch, STEP * r)[:, None] * direction
    found = ((place, located(around, place, direction)) for place in places)
    return [
        step._replace(point=place, direction=direction)
        for place, step in found
        if step is not None and step.spread > SPREAD and norm(step.point - place) < BAND * r
    ]


def settled(around: Surroundings, point: Array, direction: Array) -> Step | None:
    """Return the step nearest to a place that is not quite on the axis."""
    step: Step | None = None
    for _ in range(4):
        step = located(around, point, direction)
        if step is None or step.spread < SPREAD:
            return None
        point, direction = step.point, step.direction
    return step


def located(around: Surroundings, point: Array, direction: Array) -> Step | None:
    """Return the step at a foreseen place: the axis there, as a parabola through the moved points."""
    at = around.near(point, 1.7 * around.radius)
    frame, found = framed(direction), np.zeros(6)
    seen = around.points[at], around.normals(at)
    support, spread, excess = _kernels_tracing.fill_step(*seen, point, frame, around.radius, found)
    return Step(found[:3], normalized(found[3:]), support, spread, excess) if support else None


def _followed(around: Surroundings, steps: list[Step], jump: float) -> tuple[list[Step], str]:
    """Return steps on from the last one, over shadows, and why they end: those of a pipe have their points once."""
    r = around.radius
    while sum(step.support for step in steps) < 2 * len(around.points):  # each is on two steps
        last = steps[-1]
        step = located(around, last.point + STEP * r * last.direction, last.direction)
        if step is not None and _goes_on(steps, step, r):
            if len(steps) > 20 and norm(np.array([s.point for s in steps[:-10]]) - step.point).min() < CROSSING * r:
                return steps, "closed"
            steps.append(step)
            continue
        beyond = _beyond(around, steps, jump)
        if not beyond:
            return steps, "end"
        steps.extend(beyond)
    return steps, "length"


def _goes_on(steps: list[Step], step: Step, r: float) -> bool:
    """Whether a step is on the same pipe as those before."""
    last = steps[-1]
    usual = median(s.support for s in steps[-20:])
    onward = (step.point - last.point) @ last.direction
    wider = step.excess - _usual_excess(steps)
    return bool(
        abs(wider) < ALIKE
        and step.support > SEEN * usual
        and step.spread > SPREAD
        and 0.5 * STEP * r < onward < 2 * STEP * r
        and step.direction @ last.direction > np.cos(np.radians(45))
    )


def _usual_excess(steps: list[Step]) -> float:
    """Return by how much the pipe is wider than foreseen, so far."""
    return median(s.excess for s in steps[-20:])


def _beyond(around: Surroundings, steps: list[Step], jump: float) -> list[Step]:
    """Return the steps on the pipe behind a shadow, as far as it is seen there; none if it ends here."""
    if jump <= 0:
        return []
    r, last = around.radius, steps[-1]
    center = last.point + 0.5 * (jump + SHORT) * r * last.direction
    at = around.near(center, (0.5 * (jump + SHORT) + 1.5) * r)
    ahead = (around.points[at] - last.point) @ last.direction
    at = at[ahead > 0]
    if not len(at):
        return []
    at = at[:: -(-len(at) // MOST_GATHERED)]
    found: list[tuple[float, list[Step]]] = []
    usual, excess = median(s.support for s in steps[-20:]), _usual_excess(steps)
    for place, direction in _gatherings(around, at, last):
        if any(norm(np.array([s.point for s in part]) - place).min() < r for _, part in found):
            continue
        step = settled(around, place, direction)
        if step is None or step.support < SEEN * usual or abs(step.excess - excess) > ALIKE:
            continue
        step = _onward(step, last)
        if step is None or not any(_meets(before, step, r, jump) for before in steps[-BACK:]):
            continue
        part = _seen(around, step, last)
        alike = [*takewhile(lambda s: abs(s.excess - excess) < ALIKE, part)]  # tapers pass step by step
        away = float(norm(part[0].point - last.point))
        if alike and len(part) * STEP >= SHORT and away < (jump + 2 * STEP) * r:
            found.append((away, alike))
    return min(found, key=lambda pair: pair[0])[1] if found else []


def _gatherings(around: Surroundings, at: Indices, last: Step) -> list[tuple[Array, Array]]:
    """Return places where points moved inward gather, and the directions in which they do, the densest first."""
    if len(at) < 20:
        return []
    r, normals = around.radius, around.normals(at)
    moved = np.concatenate([around.points[at] - r * normals, around.points[at] + r * normals])
    ahead = (moved - last.point) @ last.direction
    moved = moved[ahead > -r]
    tree = cKDTree(moved)
    counts = tree.query_ball_point(moved, 0.2 * r, return_length=True)
    out: list[tuple[Array, Array]] = []
    free = np.ones(len(moved), bool)
    for k in np.argsort(-counts):
        if not free[k] or counts[k] < 6:
            continue
        free[tree.query_ball_point(moved[k], 1.0 * r)] = False
        near = moved[tree.query_ball_point(moved[k], 0.6 * r)]
        values, axes = np.linalg.eigh(np.cov(near.T))
        if values[2] > 1.5 * values[1]:
            out.append((moved[tree.query_ball_point(moved[k], 0.2 * r)].mean(axis=0), axes[:, 2]))
        if len(out) == 12:
            break
    return out


def _onward(step: Step, last: Step) -> Step | None:
    """Return a step turned away from the last one; None if it lies across."""
    way = normalized(step.point - last.point)
    sign = float(np.sign(step.direction @ way))
    if abs(step.direction @ way) < 0.2 or sign * (step.direction @ last.direction) < np.cos(MOST_TURN):
        return None
    return step._replace(direction=sign * step.direction)


def _meets(last: Step, step: Step, r: float, jump: float) -> bool:
    """Whether one straight or one bend can join two steps: their axes meet between them (constraint of 3.2.5)."""
    between = step.point - last.point
    turn = np.arccos(np.clip(last.direction @ step.direction, -1, 1))
    if turn < SLIGHT:  # where axes meet is uncertain
        middle = normalized(last.direction + step.direction)
        off = norm(between - (between @ middle) * middle)
        return bool(off < MEETING * r + 0.5 * np.tan(turn / 2) * norm(between) + 0.05 * norm(between))
    ahead, behind, apart, _ = between_axes(last.point, last.direction, step.point, step.direction)
    if abs(apart) > MEETING * r + 0.03 * norm(between):
        return False
    return bool(min(ahead, behind) > 0.5 * r * np.tan(turn / 2) and max(ahead, behind) < 2 * (jump + SHORT) * r)


def _seen(around: Surroundings, step: Step, last: Step) -> list[Step]:
    """Return the steps around one behind a shadow, from the shadow on for some radii."""
    r = around.radius
    ways = []
    for sign in (-1.0, 1.0):
        steps = [step._replace(direction=sign * step.direction)]
        while len(steps) < 12:
            ahead = located(around, steps[-1].point + STEP * r * steps[-1].direction, steps[-1].direction)
            if ahead is None or not _goes_on(steps, ahead, r):
                break
            if sign < 0 and (ahead.point - last.point) @ last.direction < 0.5 * STEP * r:
                break
            steps.append(ahead)
        ways.append(steps)
    return [s._replace(direction=-s.direction) for s in reversed(ways[0][1:])] + ways[1]
