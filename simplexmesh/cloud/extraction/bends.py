"""Bends between pipes: the torus tangent to two cylinders whose axes nearly meet is told by its radius alone."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, dot, norm, normalized
from simplexmesh.cloud.extraction.growth import ASLANT, DECISIVE, FITTED, WIDE, Grown
from simplexmesh.cloud.extraction.patches import Limits, refined
from simplexmesh.cloud.extraction.working import Working
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.pipes.chain import Chain, chain_of
from simplexmesh.cloud.pipes.tolerances import MEETING, PARALLEL, TRIED
from simplexmesh.data.primitives import Cylinder, Primitive, Torus
from simplexmesh.numerics.round_fits import between_axes

ALIKE = 0.2
"""Share by which the radii of two pipes may differ, which are fitted to a part of them, with a part of the bend."""

WIDEST = 12.0
"""Radius of a bend, in radii of the pipe."""


@dataclass(frozen=True, eq=False)
class Bend:
    """A torus between two cylinders, by their numbers; the corner (3,) where their axes meet, and evidence for it."""

    first: int
    second: int
    corner: Array
    radius: float
    evidence: float
    members: Indices


def proposed(work: Working, found: list[Grown], limits: Limits) -> list[Bend]:
    """Return the bends between cylinders, at most one at each end of each, the one of the most evidence first."""
    tree = cKDTree(work.points)
    pipes = [k for k, each in enumerate(found) if isinstance(each.primitive, Cylinder)]
    tried = [between(work, tree, found, pair, limits) for pair in combinations(pipes, 2)]
    bends = [each for each in tried if each is not None]
    taken: set[tuple[int, int]] = set()
    out = []
    for bend in sorted(bends, key=lambda each: -each.evidence):
        ends = {(k, end_of(work, found[k], bend.corner)) for k in (bend.first, bend.second)}
        if not ends & taken:
            taken |= ends
            out.append(bend)
    return out


def end_of(work: Working, pipe: Grown, corner: Array) -> int:
    """Return at which end of a pipe's points, 0 or 1, a corner is."""
    heights = (work.points[pipe.members] - corner) @ pipe.primitive._pose[1]
    return int(np.median(heights) < 0)


def between(work: Working, tree: cKDTree, found: list[Grown], pair: tuple[int, int], limits: Limits) -> Bend | None:
    """Return the bend between two cylinders, if there is one."""
    one, other = (found[k] for k in pair)
    noise = min(one.noise, other.noise)
    corner = met(work, one, other)
    if corner is None:
        return None
    at, ways, reach, radius = corner
    turn = np.pi - float(np.arccos(np.clip(dot(*ways), -1, 1)))
    if not PARALLEL < turn < np.pi - PARALLEL:
        return None
    most = min(reach / np.tan(turn / 2), WIDEST * radius)
    if most <= radius:
        return None
    length = most * np.tan(turn / 2) + 2 * radius
    near = np.array(tree.query_ball_point(at, float(np.hypot(length, 2 * radius))), dtype=np.int64)
    if len(near) < limits.fewest:
        return None
    every, near = near, near[:: -(-len(near) // (4 * FITTED))]
    corners = np.stack([at + length * ways[0], at, at + length * ways[1]])
    radii = np.geomspace(1.02 * radius, most, TRIED)
    values = [gains(work, chain_of(corners, [each], radius), near, noise).sum() for each in radii]
    chain: Chain = chain_of(corners, [radii[int(np.argmax(values))]], radius)
    for band in (WIDE, WITHIN):
        distance, gradient = chain.measured(work.points[near])
        facing = np.abs(dot(gradient, work.normals[near])) > ASLANT
        about = near[facing & (np.abs(distance) < band * noise)]
        if len(about) < limits.fewest:
            return None
        about = about[:: -(-len(about) // (4 * FITTED))]
        chain = refined(chain, work.points[about], WITHIN * noise)
    return judged(work, chain, every, pair, [one, other], noise, limits)


def met(work: Working, one: Grown, other: Grown) -> tuple[Array, Array, float, float] | None:
    """Return where axes nearly meet, the ways (2, 3) from there along the pipes, the free length, and the radius."""
    (a, u), (b, v) = one.primitive._pose, other.primitive._pose
    first, second = one.primitive._shape[0], other.primitive._shape[0]
    radius = (first + second) / 2
    if abs(first - second) > ALIKE * radius:
        return None
    if norm(cross(u, v)) < 0.01:
        return None
    ahead, _, apart, across = between_axes(a, u, b, v)
    if abs(apart) > MEETING * radius:
        return None
    at = a + ahead * u + apart / 2 * across
    ways, ends = [], []
    for axis, which in ((u, one.members), (v, other.members)):
        heights = (work.points[which] - at) @ axis
        way = axis * np.sign(np.median(heights))
        low, high = np.quantile(np.abs(heights), 0.9), np.quantile(heights * np.sign(np.median(heights)), 0.03)
        if high < -radius:
            return None
        ways.append(way)
        ends.append(low)
    return at, np.array(ways), float(min(ends)), radius


def gains(work: Working, chain: Chain | Primitive, near: Indices, noise: float) -> Array:
    """Return by how much points are likelier on a chain than outliers; 0 if far or with other normals."""
    distance, gradient = chain.measured(work.points[near])
    facing = np.abs(dot(gradient, work.normals[near])) > ASLANT
    return np.asarray(np.maximum(WITHIN**2 - (distance / noise) ** 2, 0) / 2 * facing)


def judged(
    work: Working,
    chain: Chain,
    near: Indices,
    pair: tuple[int, int],
    pipes: list[Grown],
    noise: float,
    limits: Limits,
) -> Bend | None:
    """Return the bend of a chain if it says more of them than the pipes that go on straight.

    A pipe that has less than half of its points beside the bend is a piece of that.
    """
    gain = gains(work, chain, near, noise)
    feet = chain.feet(work.points[near])
    inside = (feet.piece == 1) & (gain > 0)
    members = near[inside]
    if len(members) < limits.fewest / 2:
        return None
    if any(np.isin(pipe.members, members).mean() > 0.5 for pipe in pipes):
        return None
    straight = np.maximum(*(gains(work, pipe.primitive, members, noise) for pipe in pipes))
    new = float((gain[inside] - straight).sum())
    if new < 2 * DECISIVE:
        return None
    return Bend(*pair, chain.corners[1], float(chain.bend_radii[0]), new, members)


@dataclass(frozen=True, eq=False)
class Run:
    """Pipes and the bends between them, in order, as one chain: numbers of the cylinders and of the bends."""

    pipes: list[int]
    bends: list[int]
    chain: Chain

    def parts(self) -> tuple[list[Cylinder], list[Torus]]:
        """Return the cylinders and tori of the chain: tangent, and of one radius."""
        c, r = self.chain, float(self.chain.radii[0])
        starts = [c.corners[k] + c.limits[k].mean() * c.directions[k] for k in range(len(c.directions))]
        pipes = [Cylinder(start, way, r) for start, way in zip(starts, c.directions, strict=True)]
        axes = [normalized(np.cross(c.directions[k], c.directions[k + 1])) for k in range(len(c.bend_radii))]
        tori = [
            Torus(center, axis, max(float(bend), r), r)
            for center, axis, bend in zip(c.centers, axes, c.bend_radii, strict=True)
        ]
        return pipes, tori


def runs(points: Array, primitives: list[Primitive], members: list[Indices], bends: list[Bend]) -> list[Run]:
    """Return the pipes that bends join, from one end to the other."""
    at: dict[int, list[int]] = {}
    for k, bend in enumerate(bends):
        for pipe in (bend.first, bend.second):
            at.setdefault(pipe, []).append(k)
    left, out = set(range(len(bends))), []
    for start in sorted(at, key=lambda pipe: (len(at[pipe]), pipe)):
        pipe, pipes, order = start, [start], []
        while ways := [k for k in at[pipe] if k in left]:
            left.discard(ways[0])
            order.append(ways[0])
            pipe = bends[ways[0]].second if bends[ways[0]].first == pipe else bends[ways[0]].first
            pipes.append(pipe)
        if order:
            out.append(run(points, primitives, members, pipes, order, [bends[k] for k in order]))
    return out


def run(
    points: Array,
    primitives: list[Primitive],
    members: list[Indices],
    pipes: list[int],
    order: list[int],
    bends: list[Bend],
) -> Run:
    """Return the chain of pipes and bends."""
    corners = [bend.corner for bend in bends]
    for first, k in ((True, pipes[0]), (False, pipes[-1])):
        corner = corners[0] if first else corners[-1]
        axis = primitives[k]._pose[1]
        heights = (points[members[k]] - corner) @ axis
        far = heights[np.argmax(np.abs(heights))]
        end = corner + far * axis
        corners = [end, *corners] if first else [*corners, end]
    radius = float(np.average([primitives[k]._shape[0] for k in pipes], weights=[len(members[k]) for k in pipes]))
    chain = chain_of(np.array(corners), [max(bend.radius, 1.001 * radius) for bend in bends], radius).fitting()
    return Run(pipes, order, chain)
