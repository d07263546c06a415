"""Growth of a primitive over the points that are on it and connected, and choice of its kind as it grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.cloud.extraction import _kernels_growth
from simplexmesh.cloud.extraction.patches import AFTER, COARSEST, LEAST, Limits, fit, refined
from simplexmesh.cloud.extraction.working import NEIGHBORS, Working
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


FLAT = 2.0
"""Deviation of the feet of points from a plane, in that of means of neighbors from their surface, below which none is
told from it: such means of independent noise are a quarter of it, those of depth cameras, alike side by side, as large.
"""

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


def distances(work: Working, primitive: Primitive, which: Indices) -> Array:
    """Return the distances (m,) of some points."""
    found: Array = _kernels_growth.distances(primitive._surface, work.points, which)
    return found


def connected(work: Working, primitive: Primitive, free: Mask, seeds: Indices, band: float) -> tuple[Indices, Array]:
    """Return the free points near a primitive, with like normals, connected with seeds, and their distances (m,)."""
    found: tuple[Indices, Array] = _kernels_growth.flood(primitive._surface, work.graph, free, seeds, band, ASLANT)
    return found


def grown_once(work: Working, primitive: Primitive, free: Mask, seeds: Indices) -> Grown:
    """Return the points on a primitive that are connected with seeds; the noise is raised to that which they show."""
    noise, limit = work.noise, UNEVEN
    while True:
        members, off = connected(work, primitive, free, seeds, WITHIN * noise)
        shown = deviation(off)
        if shown <= limit * noise or noise >= COARSEST * work.noise or len(members) < LEAST:
            return Grown(primitive, members, noise, evidence(work, primitive, off, noise))
        noise, limit = min(shown, COARSEST * work.noise), SETTLED


def deviation(off: Array) -> float:
    """Return the root mean square of distances."""
    return float(np.sqrt(np.mean(off**2))) if len(off) else 0.0


def evidence(work: Working, primitive: Primitive, off: Array, noise: float) -> float:
    """Return how much more likely distances are of a primitive than outliers, less what its parameters are worth."""
    gain = float((WITHIN**2 - (off / noise) ** 2).sum()) / 2 - len(off) * float(np.log(noise / work.noise))
    return gain - 0.5 * primitive.n_parameters * float(np.log(max(len(off), 2)))


def grown(
    work: Working, primitive: Primitive, free: Mask, seeds: Indices, limits: Limits, rng: np.random.Generator
) -> Grown:
    """Return a primitive that has grown from seeds as far as it goes, of the kind that is best."""
    best = grown_once(work, primitive, free, seeds)
    for _ in range(ROUNDS):
        if len(best.members) < 8:
            break
        wide = connected(work, best.primitive, free, best.members, WIDE * best.noise)[0]
        tried = [grown_once(work, each, free, best.members) for each in candidates(work, best, wide, limits, rng)]
        before = best
        for each in tried:
            if each.evidence > best.evidence + margin(work, each, best):
                best = each
        if best.evidence < before.evidence * (1 + BETTER / 2) + 1:
            break
    return flattened(work, best, free) if is_flat(work, best) else best


def is_flat(work: Working, found: Grown) -> bool:
    """Return whether a primitive that is no plane, and fits, bends less over its points than the waves of their noise.

    Least squares of a plate are of a wide cylinder, however many points there are, where sides are seen at its edges.
    """
    if found.primitive.kind == "plane" or len(found.members) < LEAST:
        return False
    some = found.members[:: max(len(found.members) // (FITTED * NEIGHBORS), 1)]
    feet = found.primitive.projected(work.points[some])  # as near points are about as far off, if noise is large
    near = cKDTree(feet).query(feet[:: max(len(some) // FITTED, 1)], k=NEIGHBORS, workers=-1)[1]
    off = distances(work, found.primitive, some)
    bend, waves = np.linalg.eigvalsh(np.cov(feet.T))[0], off[near].mean(axis=1)
    return deviation(off) <= UNEVEN * found.noise and bool(bend < FLAT**2 * np.mean(waves**2))


def flattened(work: Working, found: Grown, free: Mask) -> Grown:
    """Return the plane of what is flat."""
    points, normals = work.points[found.members], work.normals[found.members]
    plane = fit("plane", points, normals)
    if plane is None:
        return found
    return grown_once(work, refined(plane, points, WITHIN * found.noise), free, found.members)


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
