"""Growth of a primitive over the points that are on it and connected, and choice of its kind as it grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.cloud.extraction import _kernels_growth
from simplexmesh.cloud.extraction.patches import AFTER, COARSEST, LEAST, Limits, fit, refined
from simplexmesh.cloud.extraction.working import Working
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.fitting.starts import tapered
from simplexmesh.data.primitives import Cylinder, Primitive

WIDE = 8.0
"""... within which they may be on what it turns out to be."""

ASLANT = np.cos(np.radians(40))
"""Cosine of the angle between the normals of points and of a primitive they are on: at edges normals are between."""

FITTED = 600
"""Points that a primitive is fitted to while it grows."""

ROUNDS = 2
"""Of growth, and of labels and fits."""

DECISIVE = 5.0
"""Difference of half the Bayesian information criterion that is very strong evidence (Kass and Raftery 1995)."""

BETTER = 0.02
"""... and its least share, as the noise is not known exactly."""


FLAT = 0.5
"""Deviation, in that of the noise, of the feet of points from a plane below which none is told from it: that of an arc
is 0.3 of its height, so its height is less than the band of one deviation on both sides."""

UNEVEN = 1.25
"""Noise shown by points within three deviations, in these, above which their noise is larger than it was taken for."""

SETTLED = 1.05
"""... above which a noise that grows grows on: of a normal law points within three deviations show 0.985."""


@dataclass(frozen=True, eq=False)
class Grown:
    """A primitive, the points (m,) on it, their noise, and the evidence: log likelihood above that of outliers."""

    primitive: Primitive
    members: Indices
    noise: float
    evidence: float


def fits(work: Working, primitive: Primitive, which: Indices) -> tuple[Array, Array]:
    """Return the distances (m,) of some points, and the cosines (m,) of the angles between normals."""
    found: tuple[Array, Array] = _kernels_growth.fits(primitive._surface, work.points, work.normals, which)
    return found


def connected(work: Working, primitive: Primitive, free: Mask, seeds: Indices, band: float) -> Indices:
    """Return the free points within a distance of a primitive, with like normals, connected with seeds."""
    among = (work.points, work.normals, work.near, free)
    found: Indices = _kernels_growth.flood(primitive._surface, *among, seeds, band, ASLANT)
    return found


def grown_once(work: Working, primitive: Primitive, free: Mask, seeds: Indices) -> Grown:
    """Return the points on a primitive that are connected with seeds; the noise is raised to that which they show."""
    noise, limit = work.noise, UNEVEN
    while True:
        members = connected(work, primitive, free, seeds, WITHIN * noise)
        shown = deviation(work, primitive, members)
        if shown <= limit * noise or noise >= COARSEST * work.noise or len(members) < LEAST:
            return Grown(primitive, members, noise, evidence(work, primitive, members, noise))
        noise, limit = min(shown, COARSEST * work.noise), SETTLED


def deviation(work: Working, primitive: Primitive, members: Indices) -> float:
    """Return the root mean square distance of points."""
    return float(np.sqrt(np.mean(fits(work, primitive, members)[0] ** 2))) if len(members) else 0.0


def evidence(work: Working, primitive: Primitive, members: Indices, noise: float) -> float:
    """Return how much more likely points are on a primitive than outliers, less what its parameters are worth."""
    distance = fits(work, primitive, members)[0] / noise
    gain = float((WITHIN**2 - distance**2).sum()) / 2 - len(members) * float(np.log(noise / work.noise))
    return gain - 0.5 * primitive.n_parameters * float(np.log(max(len(members), 2)))


def grown(
    work: Working, primitive: Primitive, free: Mask, seeds: Indices, limits: Limits, rng: np.random.Generator
) -> Grown:
    """Return a primitive that has grown from seeds as far as it goes, of the kind that is best."""
    best = grown_once(work, primitive, free, seeds)
    for _ in range(ROUNDS):
        if len(best.members) < 8:
            break
        wide = connected(work, best.primitive, free, best.members, WIDE * best.noise)
        tried = [grown_once(work, each, free, best.members) for each in candidates(work, best, wide, limits, rng)]
        before = best
        for each in tried:
            if each.evidence > best.evidence + margin(work, each, best):
                best = each
        if best.evidence < before.evidence * (1 + BETTER / 2) + 1:
            break
    return flattened(work, best, free) if is_flat(work, best) else best


def is_flat(work: Working, found: Grown) -> bool:
    """Return whether a primitive that is no plane bends less over its points than their noise.

    Least squares of a plate are of a wide cylinder, however many points there are, where sides are seen at its edges.
    """
    if found.primitive.kind == "plane" or found.noise > work.noise or len(found.members) < LEAST:
        return False
    some = found.members[:: -(-len(found.members) // FITTED)]
    feet = found.primitive.projected(work.points[some])
    return bool(np.linalg.eigvalsh(np.cov(feet.T))[0] < (FLAT * work.noise) ** 2)


def flattened(work: Working, found: Grown, free: Mask) -> Grown:
    """Return the plane of what is flat."""
    points, normals = work.points[found.members], work.normals[found.members]
    plane = fit("plane", points, normals)
    if plane is None:
        return found
    return grown_once(work, refined(plane, points, WITHIN * work.noise), free, found.members)


def margin(work: Working, one: Grown, other: Grown) -> float:
    """Return by how much the evidence of a primitive must be more than that of another."""
    if one.primitive.n_parameters > other.primitive.n_parameters:
        return DECISIVE + BETTER * other.noise / work.noise * max(other.evidence, 0)
    if one.primitive.kind == other.primitive.kind:
        return 0.0
    return -DECISIVE


def candidates(work: Working, now: Grown, wide: Indices, limits: Limits, rng: np.random.Generator) -> list[Primitive]:
    """Return what a primitive may turn out to be: it refined, and other kinds through its points and those about."""
    near = thinned(now.members, FITTED, rng)
    about = thinned(wide, FITTED, rng)
    scale = WITHIN * now.noise
    out = [refined(now.primitive, work.points[near], scale)]
    for kind in (kind for kinds in AFTER[now.primitive.kind] for kind in kinds):
        if kind not in limits.kinds:
            continue
        for some in (near, about) if len(wide) > 1.1 * len(now.members) else (near,):
            first = started(now.primitive, kind, work.points[some], work.normals[some])
            if first is not None:
                out.append(refined(first, work.points[about], scale))
    size = float(norm(work.points[near] - work.points[near].mean(axis=0)).max())
    return [each for each in out if limits.allow(each, size)]


def started(now: Primitive, kind: str, points: Array, normals: Array) -> Primitive | None:
    """Return a start of a kind: of cones about the axis of a cylinder, as noisy normals tell an apex too near."""
    if kind == "cone" and isinstance(now, Cylinder):
        return tapered(points, now)
    return fit(kind, points, normals)


def thinned(members: Indices, most: int, rng: np.random.Generator) -> Indices:
    """Return at most so many of the points, at random."""
    return members if len(members) <= most else rng.choice(members, most, replace=False)
