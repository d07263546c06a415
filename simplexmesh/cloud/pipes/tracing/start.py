"""The first cylinder of a pipe at a picked point, from nested neighborhoods (Chaperon 2002, 3.2.2 and 6.1.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm
from simplexmesh.cloud.fitting import starts
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.cloud.pipes.tracing._kernels_tracing import STEP
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.cloud.pipes.tracing.tracking import Track, settled, traced
from simplexmesh.data.primitives import Cylinder
from simplexmesh.numerics.plane_fits import fitted as planes_through

FEWEST, MOST, FINEST = 100, 2000, 25
"""Points of the smallest and the largest neighborhood, and the difference at which their bisection ends (6.1.2)."""

RISE = 1.5
"""How many times the mean error of smaller neighborhoods that of a larger one may be on one primitive (6.1.2)."""

FITTED = 400
"""Points of a neighborhood that are fitted to, at most: its error is that of all."""

ROUGH = 1e-4
"""Share of the cost that a last step of a fit promises to take off: what is compared differs by more."""

THIN, WIDE = 1e-3, 100.0
"""Radii of cylinders over the size of their points: others are lines and flats."""

EXACT = 1e-3
"""Error in radii below which points are on a cylinder, however exactly fewer of them are."""

NORMAL_NEIGHBORS = 20
"""Of the planes in a neighborhood of 100 points; as large a share of larger ones."""


OTHER_SIZES = (50, 100, 200, 400, 800)
"""Points of neighborhoods that are tried where nested ones mislead: near walls, or among outliers."""

LOCAL = 3.0
"""Radii of the ball in which a first cylinder is fitted again, by points that face as it does."""

FACING = 0.7
"""Cosine of the angle between the normals of the cylinder and of its points."""

ON = 0.2
"""Distance in radii of the pick from the surface, at most."""

SIDE, BAND, PEAKED = 1.0, 0.3, 0.6
"""Chord from the pick and distance from the surface, in radii, of points that are compared; the share of those within
a third of the distance, at least: of points of planes that cut the surface it is a third."""

LONG = 6.0
"""Radii of an axis that is surely traced: crosswise, or in a flat, points do not gather along more than a diameter."""

FAR = 3.0
"""Times the size of the neighborhood of its nearest point that a pick may be away from it."""


@dataclass(frozen=True)
class Beginning:
    """A place on the axis of a pipe, its direction, what is around it, and the longest shadow to jump over."""

    around: Surroundings
    point: Array
    direction: Array
    gap: float

    @cached_property
    def track(self) -> Track:
        """The axis both ways."""
        found = traced(self.around, self.point, self.direction, jump=self.gap)
        if found is None:
            raise ValueError("pick must be on a pipe, but no points gather on the axis of the cylinder there")
        return found


def beginning(
    tree: cKDTree, place: Array, limits: tuple[float, float], gap: float, *, patient: bool = True
) -> Beginning:
    """Return the beginning at a picked place with a radius within limits, or say why there is none.

    A patient one tries other neighborhoods where nested ones mislead: where no pipe is confirmed, or but a short one.
    """
    points = np.asarray(tree.data)
    distance, nearest = tree.query(place)
    size = float(tree.query(points[nearest], k=[min(FEWEST, len(points))])[0][0])
    if distance > FAR * size:
        apart = "which all have one position" if size == 0 else f"whose neighborhood of {FEWEST} is {size:.3g} wide"
        raise ValueError(f"pick must be on the cloud: its nearest point, {apart}, is {distance:.3g} away")
    short: list[Beginning] = []
    refused = ""
    for cylinder in _candidates(tree, points[nearest], OTHER_SIZES if patient else ()):
        found = _confirmed(tree, points[nearest], cylinder, limits)
        if found is None:
            continue
        if not limits[0] * 0.9 <= found.radius <= limits[1] * 1.1:
            refused = refused or f"radius must be that of the pipe at pick, about {found.radius:.4g}"
            continue
        given = limits[0] == limits[1]
        around = Surroundings(points, limits[0] if given else found.radius, radius_is_given=given)
        short.append(Beginning(around, found.point, found.axis, gap))
        if not patient or STEP * len(short[-1].track.steps) > LONG:
            return short[-1]
    if not short:
        raise ValueError(refused or "pick must be on a pipe, but no cylinder fits the points around it")
    return max(short, key=lambda each: len(each.track.steps))


def _candidates(tree: cKDTree, place: Array, sizes: tuple[int, ...]) -> Iterator[Cylinder]:
    """Yield cylinders around a place, the most trustworthy first."""
    first = first_cylinder(tree, place)
    if first is not None:
        yield first[0]
    points = np.asarray(tree.data)
    for size in sizes:
        cylinder = free_cylinder(points[tree.query(place, k=[*range(1, min(size, len(points)) + 1)])[1]])
        if cylinder is not None:
            yield cylinder


def _confirmed(tree: cKDTree, place: Array, cylinder: Cylinder, limits: tuple[float, float]) -> Cylinder | None:
    """Return a cylinder fitted again to the points around a place that face as it does; None if they are not on one."""
    if not 0.5 * limits[0] <= cylinder.radius <= 2 * limits[1]:
        return None
    for _ in range(2):
        near = np.asarray(tree.data)[tree.query_ball_point(place, LOCAL * cylinder.radius)]
        if len(near) < FEWEST // 4:
            return None
        around = Surroundings(near, cylinder.radius)
        on_axis = cylinder.point + ((place - cylinder.point) @ cylinder.axis) * cylinder.axis
        step = settled(around, on_axis, cylinder.axis)
        if step is None:
            return None
        cylinder = _refitted(around, Cylinder(step.point, step.direction, cylinder.radius))
        if not 0.5 < cylinder.radius / around.radius < 2:
            return None
    off = abs(float(cylinder.distance(place[None])[0]))
    if off > ON * cylinder.radius or not _is_peaked(around, cylinder, place):
        return None
    return cylinder.centered(place[None])


def _is_peaked(around: Surroundings, cylinder: Cylinder, place: Array) -> bool:
    """Whether points near a surface gather on it, as those of planes that cut it do not."""
    away = around.points - place
    near = norm(away - np.outer(away @ cylinder.axis, cylinder.axis)) < SIDE * cylinder.radius
    near &= np.abs(away @ cylinder.axis) < cylinder.radius
    off = np.abs(cylinder.distance(around.points[near])) / cylinder.radius
    return bool((off < BAND / 3).sum() > PEAKED * (off < BAND).sum())


def _refitted(around: Surroundings, cylinder: Cylinder) -> Cylinder:
    """Return a cylinder of least distance from points near it that face as it does."""
    for scale in (0.1, 0.05):
        distance, gradient = cylinder.measured(around.points)
        at = np.flatnonzero(np.abs(distance) < 3 * scale * cylinder.radius)
        at = at[np.abs(dot(around.normals(at), gradient[at])) > FACING]
        if len(at) < 10:
            return cylinder
        cylinder = solve(cylinder, around.points[at], loss_scale=scale * cylinder.radius, tolerance=ROUGH)
    return cylinder


def nested(fitted: Callable[[int], tuple[Any, float]], most: int) -> tuple[Any, float, int] | None:
    """Return the fit, error and size of the largest neighborhood whose error is that of smaller ones.

    Sizes double until the error rises above 1.5 times the mean of those accepted, then the last interval is bisected
    (Chaperon 2002, 6.1.2, with the mean taken over accepted errors only: rejected ones would raise it until
    contaminated sizes pass).
    """
    accepted: list[float] = []
    best: tuple[Any, float, int] | None = None

    def passes(size: int) -> bool:
        nonlocal best
        primitive, error = fitted(size)
        good = primitive is not None and (not accepted or error < RISE * float(np.mean(accepted)))
        if good:
            accepted.append(error)
            if best is None or size > best[2]:
                best = primitive, error, size
        return good

    sizes = [min(FEWEST, most)]
    while sizes[-1] < most:
        sizes.append(min(2 * sizes[-1], most))
    low = high = sizes[0]
    for high in sizes:
        if not passes(high):
            break
        low = high
    while best is not None and high - low >= FINEST:
        middle = (low + high) // 2
        low, high = (middle, high) if passes(middle) else (low, middle)
    return best


def free_cylinder(points: Array) -> Cylinder | None:
    """Return the cylinder fitted to points (n, 3) that lie on one, from their normals' plane; None of a flat."""
    found = starts.start("cylinder", points, local_normals(points))
    if found is None:
        return None
    cylinder = cast(Cylinder, solve(found, points, tolerance=ROUGH))
    size = float(norm(points - points.mean(axis=0)).max())
    return cylinder if THIN * size < cylinder.radius < WIDE * size else None


def local_normals(points: Array) -> Array:
    """Return normals (n, 3), of either sign, of planes through neighbors among points of one neighborhood."""
    count = min(len(points), max(NORMAL_NEIGHBORS, len(points) // 12))
    near = cKDTree(points).query(points, k=[*range(1, count + 1)])[1]
    return planes_through(points, near)[0]


def first_cylinder(tree: cKDTree, place: Array) -> tuple[Cylinder, float, int] | None:
    """Return the cylinder around a place, its error, and how many nearest points are on it."""
    points = np.asarray(tree.data)
    near = points[tree.query(place, k=[*range(1, min(MOST, len(points)) + 1)])[1]]

    def fitted(size: int) -> tuple[Cylinder | None, float]:
        at = near[:size]
        cylinder = free_cylinder(at[:: -(-size // FITTED)])
        if cylinder is None:
            return None, float("inf")
        return cylinder, max(float(np.sqrt((cylinder.distance(at) ** 2).mean())), EXACT * cylinder.radius)

    return nested(fitted, len(near))
