"""All primitives together: each takes the points that it explains best, and is fitted to them again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm
from simplexmesh.cloud.extraction._kernels_growth import settle
from simplexmesh.cloud.extraction.bends import Bend, Run, proposed, runs
from simplexmesh.cloud.extraction.growth import DECISIVE, ROUNDS, Grown, distances
from simplexmesh.cloud.extraction.patches import Limits
from simplexmesh.cloud.extraction.working import Working
from simplexmesh.cloud.fitting.refine import WITHIN
from simplexmesh.cloud.fitting.solver import solve
from simplexmesh.data.primitives import Primitive

NONE = WITHIN**2 / 2
"""Cost of a point of no primitive: that of one at three deviations."""

REACH = 4.5
"""Deviations beyond which a point is not of a primitive, whatever its neighbors are."""

OWN = 0.15
"""Share of a primitive's evidence that no other one has; with less it is superfluous."""

SINGULAR, ROUNDING = 1e-12, 1e-6
"""Share of the squared length of terms, and of the size of a primitive: less is rounding."""

PULL = 0.2
"""Of each neighbor of the same label: all sixteen bring in points that are up to four deviations away."""


@dataclass
class Parts:
    """Primitives, the bends among them, and the label (n,) of each point. Bends are the last primitives."""

    primitives: list[Primitive]
    bends: list[Bend]
    labels: Indices
    noises: list[float]

    @property
    def first_bend(self) -> int:
        """The number of the first bend among the primitives."""
        return len(self.primitives) - len(self.bends)

    def members(self) -> list[Indices]:
        """Return the points of each primitive."""
        order = np.argsort(self.labels, kind="stable")
        cuts = np.searchsorted(self.labels[order], np.arange(len(self.primitives) + 1))
        return [order[a:b] for a, b in pairwise(cuts)]


def together(work: Working, found: list[Grown], limits: Limits) -> Parts:
    """Return primitives, with bends between pipes, and labels of the points."""
    labels = np.full(len(work.points), -1)
    for k, each in enumerate(found):
        labels[each.members] = k
    primitives, members = [each.primitive for each in found], [each.members for each in found]
    bends = []
    if "torus" in limits.kinds and "cylinder" in limits.kinds:
        bends = proposed(work, found, limits)
    joined = runs(work.points, primitives, members, bends)
    noises = [*(each.noise for each in found), *(noise_of(bend, labels, found) for bend in bends)]
    state = Parts([*primitives, *([None] * len(bends))], bends, labels, noises)  # type: ignore[list-item]
    for k, bend in enumerate(bends):
        labels[bend.members] = len(primitives) + k
    for run in joined:
        put(state, run)
    for _ in range(ROUNDS):
        state = without_superfluous(work, state, limits, settled(work, state))
        settled(work, state)
        refit(work.points, state)
    return without_superfluous(work, state, limits, settled(work, state))


def noise_of(bend: Bend, labels: Indices, found: list[Grown]) -> float:
    """Return the noise of a bend: that of the find that most of its points have as label (n,), or of a pipe."""
    owners = labels[bend.members]
    counts = np.bincount(owners[owners >= 0], minlength=len(found))
    return found[int(counts.argmax()) if counts.any() else bend.first].noise


def put(state: Parts, run: Run) -> None:
    """Put the primitives of a run in their places."""
    pipes, tori = run.parts()
    for k, pipe in zip(run.pipes, pipes, strict=True):
        state.primitives[k] = pipe
    for k, torus in zip(run.bends, tori, strict=True):
        state.primitives[state.first_bend + k] = torus


def costs(work: Working, state: Parts) -> Array:
    """Return the cost (n, m) of each point at each primitive: half the square of its deviations; infinite far away."""
    out = np.full((len(work.points), len(state.primitives)), np.inf)
    halves = half_spaces(state)
    everywhere = np.arange(len(work.points))
    for k, primitive in enumerate(state.primitives):
        distance, noise = distances(work, primitive, everywhere), state.noises[k]
        at = np.flatnonzero(np.abs(distance) <= REACH * noise)
        for point, way in halves[k]:
            at = at[(work.points[at] - point) @ way >= 0]
        out[at, k] = (distance[at] / noise) ** 2 / 2 + np.log(noise / work.noise)
    return out


def half_spaces(state: Parts) -> list[list[tuple[Array, Array]]]:
    """Return the half-spaces (point, direction) that each primitive is in: bends end where their pipes begin."""
    out: list[list[tuple[Array, Array]]] = [[] for _ in state.primitives]
    for k, bend in enumerate(state.bends):
        torus = state.first_bend + k
        center = state.primitives[torus]._pose[0]
        for pipe in (bend.first, bend.second):
            origin, axis = state.primitives[pipe]._pose
            foot = origin + dot(center - origin, axis) * axis
            way = axis * np.sign(dot(foot - bend.corner, axis))
            out[pipe].append((foot, way))
            out[torus].append((foot, -way))
    return out


def settled(work: Working, state: Parts) -> Array:
    """Let points take the labels of least cost, as those about them do; return the costs (n, m)."""
    cost = costs(work, state)
    for _ in range(ROUNDS):
        if settle(work.beside, cost, NONE, PULL, state.labels) < 1e-3 * len(work.points):
            break
    return cost


def without_superfluous(work: Working, state: Parts, limits: Limits, cost: Array) -> Parts:
    """Return the state without primitives that have too few points, or whose points others explain as well."""
    cost = np.minimum(cost, NONE)
    sizes = [len(each) for each in state.members()]
    kept = np.ones(len(state.primitives), bool)
    bound = {k for bend in state.bends for k in (bend.first, bend.second)} | set(
        range(state.first_bend, len(state.primitives))
    )
    for k in sorted(range(len(kept)), key=lambda k: (k in bound, sizes[k])):
        mine = np.flatnonzero(state.labels == k)  # with what went to it from others
        others = np.setdiff1d(np.flatnonzero(kept), [k])
        if k not in bound and (whole := wave_of(work, state, k, others)) is not None:
            kept[k], state.labels[mine] = False, whole
            continue
        own = cost[mine, k]
        rest = cost[np.ix_(mine, others)].min(axis=1, initial=NONE)
        gain = float(np.maximum(rest - own, 0).sum())
        price = 0.5 * state.primitives[k].n_parameters * np.log(max(len(mine), 2)) + DECISIVE
        least = limits.fewest if k not in bound else limits.fewest / 2
        size = float(norm(np.ptp(work.points[mine], axis=0))) if len(mine) else 0.0
        kept[k] = (
            len(mine) >= least
            and limits.allow(state.primitives[k], size)
            and gain > price + OWN * float((NONE - own).sum())
        )
        if not kept[k] and len(mine) and len(others):
            rest = cost[np.ix_(mine, others)]
            state.labels[mine] = np.where(rest.min(axis=1) < NONE, others[rest.argmin(axis=1)], -1)
    return state if kept.all() else chosen(state, kept)


def wave_of(work: Working, state: Parts, part: int, others: Indices) -> int | None:
    """Return the larger primitive that has a part's points, as far off as they are, among waves as high; or None.

    The noise of depth cameras is alike in many points side by side, so these are no evidence of a shape of their own.
    Waves are means, over as many points as the part has, of distances from the primitive, less what a quadric of place
    tells: a bent whole is no wavy one.
    """
    mine = np.flatnonzero(state.labels == part)
    around = state.labels[work.near[mine]]
    around = around[np.isin(around, others)]
    if not len(around):
        return None
    whole = int(np.bincount(around).argmax())
    rows = np.flatnonzero(state.labels == whole)
    offset, off = (distances(work, state.primitives[whole], some) for some in (mine, rows))
    limit = np.mean(offset**2) / REACH**2
    if len(rows) <= len(mine) or limit > np.mean(off**2):
        return None
    feet = state.primitives[whole].projected(work.points[rows])  # else a cell may have one side of it only
    places = feet - feet.mean(axis=0)
    size = max(float(np.abs(places).max()), 1e-300)
    bend = _quadric_terms(places / size)
    off = off - bend @ np.linalg.lstsq(bend.T @ bend, bend.T @ off, rcond=SINGULAR)[0]
    number = np.floor(places / max(work.spacing * np.sqrt(len(mine)), ROUNDING * size)).astype(np.int64)
    number -= number.min(axis=0)
    cell = np.unique(np.ravel_multi_index(tuple(number.T), number.max(axis=0) + 1), return_inverse=True)[1]
    waves = (np.bincount(cell, off) / np.bincount(cell))[cell]
    return whole if limit <= np.mean(waves**2) else None


def _quadric_terms(places: Array) -> Array:
    """Return (n, 10) the values of the monomials up to the second degree at places (n, 3)."""
    one = np.column_stack([np.ones(len(places)), places])
    first, second = np.triu_indices(4)
    return one[:, first] * one[:, second]


def chosen(state: Parts, kept: Mask) -> Parts:
    """Return the state of some of the primitives; a bend without one of its pipes is a torus like others."""
    first = state.first_bend
    whole = [k for k, bend in enumerate(state.bends) if kept[[first + k, bend.first, bend.second]].all()]
    last = [first + k for k in whole]
    order = [*np.setdiff1d(np.flatnonzero(kept), last), *last]
    place = np.full(len(kept) + 1, -1)
    place[order] = np.arange(len(order))
    bends = [state.bends[k] for k in whole]
    bends = [replace(bend, first=int(place[bend.first]), second=int(place[bend.second])) for bend in bends]
    return Parts([state.primitives[k] for k in order], bends, place[state.labels], [state.noises[k] for k in order])


def refit(points: Array, state: Parts) -> None:
    """Fit all primitives to their points: pipes and bends as one, the others by themselves."""
    members = state.members()
    bound: set[int] = set()
    for run in runs(points, state.primitives, members, state.bends):
        numbers = [*run.pipes, *(state.first_bend + k for k in run.bends)]
        own = points[np.concatenate([members[k] for k in numbers])]
        chain = solve(run.chain, own, loss_scale=WITHIN * max(state.noises[k] for k in numbers))
        put(state, replace(run, chain=chain))
        for k, corner, radius in zip(run.bends, chain.corners[1:-1], chain.bend_radii, strict=True):
            state.bends[k] = replace(state.bends[k], corner=corner, radius=float(radius))
        bound |= set(numbers)
    for k in set(range(len(state.primitives))) - bound:
        state.primitives[k] = solve(state.primitives[k], points[members[k]], loss_scale=WITHIN * state.noises[k])
