"""Points as dense along the lines of a scanner as across: of those denser along, the nearest are all on one line."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot
from simplexmesh.numerics import _kernels_local_fits

NARROW = 0.1
"""Of the variance along neighbors, that across them on a line; of that across, that along the normal of a surface."""

COUNT = 8
"""Neighbors that tell a line."""

FARTHEST = 512
"""Rank of the farthest neighbor that is looked at."""

CONFIRMED = 4
"""Times as far, what spans a surface still does: noise about a line looks like one where it is as wide as long."""

ACROSS, ROUND = 0.3, 0.25
"""Cosine between the planes of neighbors near and far, below which the near ones are a line and its noise, and share of
the variance across far ones that is along their normal, at most: both sides of a wall are rounder."""

EVERY, PLACES = 16, (2000, 20_000)
"""Point that is looked at, one in so many, and how many tell whether there are lines at all, and at most where."""

AGREEING, TOGETHER = 15, 4
"""Places next to each other whose median step is taken, and all of which are on lines: by chance one in 15 seems so."""


class Even(NamedTuple):
    """Those of some points that are as dense along lines as across."""

    points: Array  # (n, 3) all
    rows: Indices  # (m,) of those
    tree: cKDTree  # of those

    def near(self, places: Indices, count: int) -> tuple[Array, Indices]:
        """Return distances and rows (k, count) of some points: each itself, and the nearest of those that are even."""
        count = min(count, len(self.rows))
        distance, found = self.tree.query(self.points[places], k=[*range(1, count + 1)], workers=-1)
        near = self.rows[found]
        itself = near == places[:, None]
        new = np.flatnonzero(~itself[:, 0])
        itself[~itself.any(axis=1), -1] = True  # instead of the farthest
        others = near[new][~itself[new]].reshape(len(new), count - 1)
        apart = distance[new][~itself[new]].reshape(len(new), count - 1)
        near[new] = np.column_stack([places[new], others])
        distance[new] = np.column_stack([np.zeros(len(new)), apart])
        return distance, near


def even(tree: cKDTree) -> Even:
    """Return the points of a tree of which as many are left as are as dense along lines as across."""
    points = np.asarray(tree.data)
    if len(few := without_piles(tree)) < len(points):
        found = even(cKDTree(points[few]))
        return Even(points, few[found.rows], found.tree)
    rows = thinned(points, steps(tree))
    return Even(points, rows, tree if len(rows) == len(points) else cKDTree(points[rows]))


def without_piles(tree: cKDTree) -> Indices:
    """Return the rows of points of which no more are at one place than in a leaf: in others a search takes all.

    Leaves with more points are of one place, and hold them next to each other.
    """
    ordered = np.asarray(tree.data)[tree.indices]
    piled = (ordered[tree.leafsize :] == ordered[: -tree.leafsize]).all(axis=1)
    return np.sort(np.delete(tree.indices, tree.leafsize + np.flatnonzero(piled)))


def thinned(points: Array, step: Indices) -> Indices:
    """Return the rows of one in `step` (n,) points, spread evenly: in the order in which space is halved."""
    if (step <= 1).all():
        return np.arange(len(points))
    order = cKDTree(points, leafsize=1).indices
    share = 1 / np.maximum(step[order], 1)
    total = np.cumsum(share)  # exact, as steps are powers of two
    return np.sort(order[np.floor(total) > np.floor(total - share)])


def steps(tree: cKDTree) -> Indices:
    """Return the step 1, 2, 4 ... (n,) at which the points nearest to each span a surface; 0 where none does.

    There nothing is beside the line. More than an eighth of a bent curve is no line. Places tell their surroundings.
    """
    points = np.asarray(tree.data)
    if (tree.maxes == tree.mins).all():  # a leaf of all, in which each search takes them one by one
        return np.zeros(tree.n, np.int64)
    few = max(1, tree.n // PLACES[0])
    every = max(min(EVERY, few), -(-tree.n // PLACES[1]))
    if every < few:
        places = points[tree.indices[::few]]
        if not (_steps(tree, places) != 1)[_near(cKDTree(places), TOGETHER)].all(axis=1).any():
            return np.ones(tree.n, np.int64)
    places = points[tree.indices[::every]]
    some = cKDTree(places)
    found = _among_lines(tree, places, some, _steps(tree, places))
    agreed = np.median(found[_near(some, AGREEING)], axis=1).astype(np.int64)
    if (agreed == agreed[0]).all():
        return np.full(tree.n, agreed[0])
    return agreed[some.query(points, workers=-1)[1]]


def _among_lines(tree: cKDTree, places: Array, some: cKDTree, found: Indices) -> Indices:
    """Return the steps (m,) of places: 1 where most that the surface is through are on no lines, as beside a pipe."""
    out = found.copy()
    for step in np.unique(found[found > 1]):
        at = np.flatnonzero(found == step)
        beside = tree.query(places[at], k=np.minimum(1 + step * np.arange(COUNT // 2, COUNT), tree.n), workers=-1)[1]
        own = found[some.query(np.asarray(tree.data)[beside], workers=-1)[1]]
        out[at[(own == 1).mean(axis=1) >= 0.5]] = 1
    return out


def _near(tree: cKDTree, count: int) -> Indices:
    """Return the rows (n, count) of the places of a tree that are nearest to each."""
    return np.asarray(tree.query(tree.data, k=[*range(1, min(count, tree.n) + 1)], workers=-1)[1])


def _steps(tree: cKDTree, places: Array) -> Indices:
    """Return the least step (m,) from which on neighbors of places span one surface, or the first that seems to."""
    on_line, first, since = np.zeros(len(places), bool), *np.zeros((2, len(places)), np.int64)
    normals = np.zeros_like(places)
    left, step, farthest = np.arange(len(places)), 1, max(1, min(FARTHEST, tree.n // 8) // COUNT)
    while len(left) and step <= farthest:
        moments, normal = _planes(tree, places[left], step)
        thick, across, along = moments.T
        narrow, flat = across <= NARROW * along, thick <= NARROW * across
        turned = (thick <= ROUND * across) & (since[left] > 0) & (np.abs(dot(normal, normals[left])) < ACROSS)
        on_line[left] |= narrow | turned
        since[left[narrow | turned]] = 0
        new = ~narrow & (on_line[left] | flat) & (since[left] == 0)
        since[left[new]], normals[left[new]] = step, normal[new]
        first = np.where(first > 0, first, since)
        left = left[(since[left] == 0) | (step < CONFIRMED * since[left])]
        step *= 2
    return np.where(on_line, np.where(since > 0, since, first), 1)


def _planes(tree: cKDTree, places: Array, step: int) -> tuple[Array, Array]:
    """Return the mean squares (m, 3) along the principal axes of neighbors, ascending, and the first axes (m, 3)."""
    moments, normals = np.empty((len(places), 3)), np.empty((len(places), 3))
    near = tree.query(places, k=np.minimum(1 + step * np.arange(COUNT), tree.n), workers=-1)[1]
    _kernels_local_fits.fill_moments(len(near), tree.data, near, moments, normals)
    return moments, normals
