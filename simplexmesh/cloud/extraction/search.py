"""One primitive after the other, the one of the most evidence first, out of what is left of a cloud."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Indices, Mask
from simplexmesh._base.progress import Progress, _silent
from simplexmesh.cloud.extraction import _kernels_growth
from simplexmesh.cloud.extraction.growth import ASLANT, SETTLED, Grown, deviation, distances, grown, grown_once
from simplexmesh.cloud.extraction.patches import DOUBLINGS, LEAST, Limits, patch
from simplexmesh.cloud.extraction.working import Working
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.fitting.selection import SURFACES

BATCH = 12
"""Seeds from which patches grow before the best is taken."""

MISSED = 0.02
"""Probability that a shape of the fewest points has no seed when the search ends."""

MOST_SEEDS = 200
"""Without a find, after which the search ends in any case."""

TRIED = 3
"""Best candidates that grow in full."""

SPLIT = 0.2
"""Share of points within half of their noise below which they are of two sheets: of a normal law it is 0.38."""

TOGETHER = 0.5
"""Share of the neighbors of a primitive's points that are on it too: of points that are by chance few are."""


def found_one_by_one(
    work: Working, limits: Limits, rng: np.random.Generator, report: Progress = _silent
) -> list[Grown]:
    """Return primitives with their points, which are of one primitive each."""
    alive = np.ones(len(work.points), bool)
    pool: list[Grown] = []
    out: list[Grown] = []
    barren = 0
    while alive.sum() >= limits.fewest:
        free = np.flatnonzero(alive)
        able = free[work.smooth[free] & (alive[work.near[free]].mean(axis=1) > TOGETHER)]
        if len(able) < limits.fewest:
            break
        patience = np.log(MISSED) / np.log1p(-min(limits.fewest / len(able), 0.9))
        if barren < min(patience, MOST_SEEDS):
            pool += hypotheses(work, alive, rng.choice(able, min(BATCH, len(able)), replace=False), limits)
            barren += BATCH
        elif not pool:
            break
        pool.sort(key=lambda each: -each.evidence)
        best = None
        for each in [each for each in pool[:TRIED] if gathers(work, each, alive)]:
            full = grown(work, each.primitive, alive, each.members, limits, rng)
            sound = len(full.members) >= limits.fewest and gathers(work, full, alive)
            if sound and (best is None or full.evidence > best.evidence):
                best = full
        pool = pool[TRIED:]
        if best is None:
            continue
        if (whole := piece_of(work, best, alive, limits, rng)) is not None:
            alive[taken(work, whole)] = False
            continue
        out.append(best)
        report(0.1 + 0.7 * (1 - float(alive.mean())), "finding primitives")
        barren = 0
        alive[taken(work, best)] = False
        pool = [each for each in (renewed(each, alive) for each in pool) if len(each.members) >= limits.fewest]
    return out


def hypotheses(work: Working, alive: Mask, seeds: Indices, limits: Limits) -> list[Grown]:
    """Return the primitives of patches about seeds that have grown once."""
    free = np.flatnonzero(alive)
    tree = cKDTree(work.points[free], balanced_tree=False, compact_nodes=False)
    count = min(LEAST * 2**DOUBLINGS, len(free))
    out = []
    for seed in seeds:
        near = free[tree.query(work.points[seed], k=count)[1]]
        found = patch(work, near, limits)
        if found is not None:
            out.append(grown_once(work, found, alive, near[:LEAST]))
    return [each for each in out if len(each.members) >= min(limits.fewest, LEAST) // 2]


def piece_of(work: Working, found: Grown, alive: Mask, limits: Limits, rng: np.random.Generator) -> Grown | None:
    """Return the primitive, of a kind that is not looked for, that one is a small piece of: a pipe is no planes."""
    if set(limits.kinds) == set(SURFACES):
        return None
    whole = grown(work, found.primitive, alive, found.members, replace(limits, kinds=SURFACES), rng)
    return None if whole.primitive.kind in limits.kinds or 2 * found.evidence > whole.evidence else whole


def gathers(work: Working, found: Grown, alive: Mask) -> bool:
    """Return whether points gather about a primitive, as those of a volume do not."""
    if uneven := found.noise > work.noise:
        off = np.abs(distances(work, found.primitive, found.members))
        if deviation(off) > SETTLED * found.noise or (off < found.noise / 2).mean() < SPLIT:
            return False
        if np.median(work.rough[found.members]) > found.noise:  # a bent surface is smooth all the same
            return False
    among = (found.primitive._surface, work.graph, alive, found.members)
    left, close = _kernels_growth.around(*among, WITHIN * found.noise, ASLANT)
    return bool(close >= TOGETHER * (len(found.members) * (work.near.shape[1] - 1) if uneven else left))


def taken(work: Working, found: Grown) -> Indices:
    """Return the points of a find, and what is as near to it about them, whatever the normals."""
    near = np.zeros(len(work.points), bool)
    near[work.near[found.members]] = True
    about = np.flatnonzero(near)
    return about[np.abs(distances(work, found.primitive, about)) <= WITHIN * found.noise]


def renewed(each: Grown, alive: Mask) -> Grown:
    """Return a candidate with those of its points that are left."""
    left = each.members[alive[each.members]]
    share = len(left) / max(len(each.members), 1)
    return replace(each, members=left, evidence=each.evidence * share)
