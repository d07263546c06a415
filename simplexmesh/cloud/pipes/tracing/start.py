"""The first cylinder of a pipe at a picked point, confirmed by the points about it (Chaperon 2002, 3.2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm
from simplexmesh.cloud.extraction.patches import refined
from simplexmesh.cloud.pipes.tolerances import BAND, FACING, FEWEST, NEAR, SHORT
from simplexmesh.cloud.pipes.tracing._kernels_tracing import STEP
from simplexmesh.cloud.pipes.tracing.hypotheses import hypotheses, noise_at
from simplexmesh.cloud.pipes.tracing.surroundings import Surroundings
from simplexmesh.cloud.pipes.tracing.tracking import Track, along, settled, traced
from simplexmesh.data.primitives import Cylinder

ON, FAR_OFF = 0.2, 2
"""Distance of the pick from the surface, at most, in radii, and in deviations that other points have at most."""

ANY = (0.0, np.inf)
"""Limits of any radius, and what is tried to tell which one it is if it is not that which is asked for."""


@dataclass(frozen=True)
class Beginning:
    """A place on the axis of a pipe, its direction, what is around it, and the longest shadow to jump over.

    `stretch` has the heights about the place between which the pipe is known to be straight.
    """

    around: Surroundings
    point: Array
    direction: Array
    gap: float
    stretch: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def track(self) -> Track:
        """The axis both ways."""
        known = along(self.around, self.point, self.direction, self.stretch)
        first = None if known else settled(self.around, self.point, self.direction)
        if first is not None:
            known = [first]
        if not known:
            raise ValueError("pick must be on a pipe, but no points gather on the axis of the cylinder there")
        found = traced(self.around, known, jump=self.gap)
        if "length" in found.stops:
            raise ValueError("pick must be on a pipe, but that which is there is longer than its points are many")
        return found


def beginning(tree: cKDTree, place: Array, limits: tuple[float, float], gap: float, noise: float = np.inf) -> Beginning:
    """Return the beginning at a picked place with a radius within limits, or say why there is none.

    Of cylinders from neighborhoods of several sizes the first of a long axis, or that of the longest: crosswise, or in
    a flat, points gather along no more than a diameter.
    """
    points = np.asarray(tree.data)
    distance, nearest = tree.query(np.clip(place, -1e100, 1e100))  # of what is farther the square overflows
    size = float(tree.query(points[nearest], k=[min(FEWEST, len(points))])[0][0])
    if distance > NEAR * size:
        apart = "which all have one position" if size == 0 else f"whose neighborhood of {FEWEST} is {size:.3g} wide"
        raise ValueError(f"pick must be on the cloud: its nearest point, {apart}, is {distance:.3g} away")
    begun, refused = [], "pick must be on a pipe, but no cylinder fits the points around it"
    here = noise_at(tree, points[nearest]) if noise == np.inf else noise
    tried = (hypotheses(tree, points[nearest], each, here) for each in dict.fromkeys((limits, ANY)))
    for cylinder in chain.from_iterable(tried):
        found = _confirmed(tree, points[nearest], cylinder, here)
        if found is None:
            continue
        if limits[0] * 0.9 <= found.radius <= limits[1] * 1.1:
            given = limits[0] == limits[1]
            radius = limits[0] if given else found.radius
            around = Surroundings(points, radius, radius_is_given=given, noise=noise)
            begun.append(Beginning(around, found.point, found.axis, gap))
            if STEP * len(begun[-1].track.steps) > 4 * SHORT:
                break
        else:
            refused = f"radius must be that of the pipe at pick, about {found.radius:.4g}"
    if not begun:
        raise ValueError(refused)
    return max(begun, key=lambda each: len(each.track.steps))


def _confirmed(tree: cKDTree, place: Array, cylinder: Cylinder, noise: float) -> Cylinder | None:
    """Return a cylinder fitted again to the points around a place that face as it does; None if they are not on one."""
    for _ in range(2):
        near = np.asarray(tree.data)[tree.query_ball_point(place, NEAR * cylinder.radius)]
        if len(near) < FEWEST // 4:
            return None
        around = Surroundings(near, cylinder.radius, noise=noise)
        on_axis = cylinder.point + ((place - cylinder.point) @ cylinder.axis) * cylinder.axis
        step = settled(around, on_axis, cylinder.axis)
        if step is None:
            return None
        cylinder = _refitted(around, Cylinder(step.point, step.direction, cylinder.radius))
        if not 0.5 < cylinder.radius / around.radius < 2:
            return None
    off = abs(float(cylinder.distance(place[None])[0]))
    if off > min(ON * cylinder.radius, FAR_OFF * around.most_deviation) or not _is_peaked(around, cylinder, place):
        return None
    return cylinder.centered(place[None])


def _is_peaked(around: Surroundings, cylinder: Cylinder, place: Array) -> bool:
    """Whether most points near a surface are on it, as far as noise may be: of planes that cut it a third are."""
    away = around.points - place
    near = norm(away - np.outer(away @ cylinder.axis, cylinder.axis)) < cylinder.radius
    near &= np.abs(away @ cylinder.axis) < cylinder.radius
    off = np.abs(cylinder.distance(around.points[near]))
    off = off[off < BAND * cylinder.radius]
    return len(off) > 0 and bool(np.median(off) < min(BAND / 3 * cylinder.radius, around.most_deviation))


def _refitted(around: Surroundings, cylinder: Cylinder) -> Cylinder:
    """Return a cylinder of least distance from points near it that face as it does."""
    for scale in (0.1, 0.05):
        distance, gradient = cylinder.measured(around.points)
        at = np.flatnonzero(np.abs(distance) < 3 * scale * cylinder.radius)
        at = at[np.abs(dot(around.normals(at), gradient[at])) > FACING]
        if len(at) < 10:
            return cylinder
        cylinder = refined(cylinder, around.points[at], scale * cylinder.radius)
    return cylinder
