"""Lines of pipes at random: straight parts, bends, reducers and tees, seen in part, by a wall and a floor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simplexmesh._base.vectors import norm
from tests.cloud.scenes.clearance import apart, filled
from tests.cloud.scenes.shapes import Shape, bend, cone, perpendicular, pipe, plane, sampled

BACKGROUND = 0.25
"""Density of the points of wall and floor, in that of the pipes."""

RADII = (0.03, 0.15)
"""Least and greatest of the tubes, in metres."""

TRIES = 200
"""Attempts to place one element before the line is begun anew."""

HALF = 0.5
"""Of no element more of the length is in shadow."""


@dataclass(frozen=True, eq=False)
class Element:
    """A part of a line: "straight", "bend" or "reducer", between two points (3,) of its center line.

    `radius` is that of the tube, of reducers at the start, where it becomes `end_radius`; `bend_radius` and `angle`
    are 0 of all but bends. `shape` is its number among the shapes.
    """

    kind: str
    start: np.ndarray
    end: np.ndarray
    radius: float
    end_radius: float
    bend_radius: float
    angle: float
    shape: int


@dataclass(frozen=True, eq=False)
class PipeLine:
    """Points (n, 3), the number (n,) of the shape of each, -1 for outliers, the shapes, and the elements in order.

    Branches at tees are shapes of no element, and `tees` are pairs of their numbers and those of the pipes they leave.
    `picks` are numbers of points of straight elements. `gaps` (k, 2) are ranges of length along the line in shadow.
    """

    points: np.ndarray
    labels: np.ndarray
    shapes: tuple[Shape, ...]
    elements: tuple[Element, ...]
    noise: float
    picks: np.ndarray
    gaps: np.ndarray
    tees: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Make:
    """What lines are made of: lengths in tube radii, angles in degrees."""

    ratios: tuple[float, float] = (1.25, 10.0)
    angles: tuple[float, float] = (15.0, 120.0)
    lengths: tuple[float, float] = (4.0, 15.0)
    reducers: int = 0
    tees: int = 0


@dataclass(frozen=True)
class View:
    """How lines are seen: noise in tube radii, shares, degrees around, gaps with their length in tube radii."""

    noise: float = 0.02
    outliers: float = 0.02
    around: float = 200.0
    gaps: int = 2
    longest: float = 5.0
    walls: bool = True


def pipe_line(seed, elements=12, *, make=None, view=None, count=60_000):
    """A line of elements, straight parts at every second place, in a random pose, radii of 3 to 15 cm.

    As many points are spread evenly, then those taken away that are not seen.
    """
    make, view, rng = make or Make(), view or View(), np.random.default_rng(seed)
    while (built := walked(elements, make, rng)) is None:
        pass
    shapes, parts, tees = built
    radius, pipes = parts[0].radius, len(shapes)
    if view.walls:
        shapes = [*shapes, *walls(shapes, radius, rng)]
    weights = np.where(np.arange(len(shapes)) < pipes, 1, BACKGROUND)
    points, normals, labels = sampled(shapes, count, rng, weights)
    gaps = shadows(parts, view, rng)
    seen = on_the_side(shapes, parts, points, normals, labels, view.around, rng)
    seen &= lit(shapes, parts, points, labels, gaps) & outside_tees(shapes, tees, points, labels)
    points, normals, labels = points[seen], normals[seen], labels[seen]
    points = points + rng.normal(0, view.noise * radius, (len(points), 1)) * normals
    rogue = round(view.outliers / (1 - view.outliers) * len(points))
    strays = rng.uniform(points.min(axis=0), points.max(axis=0), (rogue, 3))
    order = rng.permutation(len(points) + rogue)
    labels = np.append(labels, np.full(rogue, -1))[order]
    rotation, shift = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-10, 10, 3)
    return PipeLine(
        np.concatenate([points, strays])[order] @ rotation.T + shift,
        labels,
        tuple(shape.moved(rotation, shift) for shape in shapes),
        tuple(replace(part, start=rotation @ part.start + shift, end=rotation @ part.end + shift) for part in parts),
        view.noise * radius,
        np.array([rng.choice(np.flatnonzero(labels == part.shape)) for part in parts if part.kind == "straight"]),
        gaps,
        tees,
    )


def kinds(elements, reducers, rng):
    """Straight parts at every second place, and between them bends and so many reducers."""
    between = np.arange(1, elements - 1, 2)
    if reducers > len(between):
        raise ValueError(f"a line of {elements} elements has room for {len(between)} reducers, not {reducers}")
    changes = rng.choice(between, reducers, replace=False)
    return ["straight" if k % 2 == 0 else "reducer" if k in changes else "bend" for k in range(elements)]


def walked(elements, make, rng):
    """Shapes, elements and tees of a line that keeps a tube radius clear of itself; None if it found no way."""
    radius, at, along = RADII[0] * (RADII[1] / RADII[0]) ** rng.uniform(), np.zeros(3), perpendicular(np.zeros(3), rng)
    shapes, parts = [], []
    for number, kind in enumerate(kinds(elements, make.reducers, rng)):
        for _ in range(TRIES):
            shape, part, after = grown(kind, at, along, radius, number, make, rng)
            far = shapes[: -2 if kind == "straight" else -1]
            if all(apart(shape, other, radius) for other in far):
                break
        else:
            return None
        shapes, parts, along = [*shapes, shape], [*parts, part], after
        at, radius = part.end, part.end_radius
    if parts[-1].kind == "bend":
        shapes[-1] = replace(shapes[-1], joins=(elements - 2,))
    tees = []
    for number in rng.permutation([part.shape for part in parts if part.kind == "straight"])[: make.tees]:
        branch = branched(parts[number], shapes[number], rng)
        if not all(apart(branch, other, 0.0) for other in shapes[:number] + shapes[number + 1 :]):
            return None
        tees.append((len(shapes), int(number)))
        shapes.append(branch)
    return shapes, parts, tuple(tees)


def grown(kind, at, along, radius, number, make, rng):
    """One more shape and element from a point and direction, and the direction after it."""
    bend_radius = angle = 0.0
    end_radius, after = radius, along
    if kind == "bend":
        low, high = make.ratios
        bend_radius, angle = radius * low * (high / low) ** rng.uniform(), np.radians(rng.uniform(*make.angles))
        joins = (number - 1, number + 1)
        shape, end, after = bend(at, along, perpendicular(along, rng), bend_radius, radius, angle, joins)
    elif kind == "reducer":
        narrow, half_angle = rng.uniform(0.5, 0.8), np.radians(rng.uniform(8, 25))
        widens = radius * narrow < RADII[0] or (radius / narrow < RADII[1] and rng.uniform() < 0.5)
        end_radius = radius / narrow if widens else radius * narrow
        heights = np.array([radius, end_radius]) / np.tan(half_angle)
        toward = along if widens else -along
        shape = cone(at - heights[0] * toward, toward, half_angle, np.sort(heights))
        end = at + abs(heights[1] - heights[0]) * along
    else:
        end = at + radius * rng.uniform(*make.lengths) * along
        shape = pipe(at, end, radius)
    return shape, Element(kind, at, end, radius, end_radius, float(bend_radius), float(angle), number), after


def branched(part, shape, rng):
    """A narrower pipe from the middle third of a straight part, at right angles to it."""
    start = part.start + rng.uniform(1 / 3, 2 / 3) * (part.end - part.start)
    return pipe(
        start,
        start + part.radius * rng.uniform(4, 9) * perpendicular(shape.axis, rng),
        part.radius * rng.uniform(0.4, 0.9),
    )


def walls(shapes, radius, rng):
    """A floor and a wall that pass the line at half to three tube radii."""
    centers, radii = (np.concatenate(each) for each in zip(*map(filled, shapes), strict=True))
    low, high = (centers - radii[:, None]).min(axis=0), (centers + radii[:, None]).max(axis=0)
    low = low - rng.uniform(0.5, 3, 3) * radius
    x, y, z = (high - low) * np.eye(3)
    return [plane(low, x, y), plane(low, z, x)]


def measures(parts):
    """Where along the center line the elements begin and end (k + 1,)."""
    lengths = [part.bend_radius * part.angle or norm(part.end - part.start) for part in parts]
    return np.append(0, np.cumsum(lengths))


def shadows(parts, view, rng):
    """Ranges of length (k, 2) without points, of one up to the longest gap, which leave half of each element."""
    ends = measures(parts)
    gaps = np.zeros((0, 2))
    while len(gaps) < view.gaps:
        start = rng.uniform(0, ends[-1])
        radius = parts[np.searchsorted(ends, start, side="right") - 1].radius
        tried = np.concatenate([gaps, [[start, start + radius * rng.uniform(1, view.longest)]]])
        shaded = np.minimum(ends[1:], tried[:, 1:]) - np.maximum(ends[:-1], tried[:, :1])
        lost = np.clip(shaded, 0, None).sum(axis=0)
        if (lost < HALF * np.diff(ends)).all() and tried[-1, 1] < ends[-1]:
            gaps = tried
    return gaps


def lit(shapes, parts, points, labels, gaps):
    """Whether points are of no gap."""
    ends, out = measures(parts), np.ones(len(points), bool)
    for part, start in zip(parts, ends, strict=False):
        rows = np.flatnonzero(labels == part.shape)
        shape = shapes[part.shape]
        if part.kind == "bend":
            at = start + shape.radius * np.mod(shape.coordinates(points[rows])[:, 0], 2 * np.pi)
        else:
            at = start + (points[rows] - part.start) @ (part.end - part.start) / norm(part.end - part.start)
        out[rows] = ~((at[:, None] > gaps[:, 0]) & (at[:, None] < gaps[:, 1])).any(axis=1)
    return out


def on_the_side(shapes, parts, points, normals, labels, around, rng):
    """Whether points are on the seen side of the tube: within so many degrees about a direction that bends with it."""
    out, seen_from = np.ones(len(points), bool), None
    for part in parts:
        rows, shape = np.flatnonzero(labels == part.shape), shapes[part.shape]
        if seen_from is None:
            seen_from = perpendicular(shape.axis, rng)
        if part.kind == "bend":
            back = Rotation.from_rotvec(-shape.coordinates(points[rows])[:, :1] * shape.axis)
            across, after = back.apply(normals[rows]), Rotation.from_rotvec(part.angle * shape.axis).apply(seen_from)
        else:
            across, after = normals[rows] - np.outer(normals[rows] @ shape.axis, shape.axis), seen_from
        out[rows] = across @ seen_from >= norm(across) * np.cos(np.radians(around / 2))
        seen_from = after
    return out


def outside_tees(shapes, tees, points, labels):
    """Whether points are not inside of a branch or of the pipe it leaves."""
    out = np.ones(len(points), bool)
    for branch, main in tees:
        ahead = (points - shapes[branch].point) @ shapes[branch].axis > 0
        out &= ~((labels == main) & ahead & (shapes[branch].distance(points) < 0))
        out &= ~((labels == branch) & (shapes[main].distance(points) < 0))
    return out
