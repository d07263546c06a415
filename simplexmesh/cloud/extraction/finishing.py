"""Labels of all points of a cloud, and how primitives fit them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.cloud.extraction import _kernels_growth
from simplexmesh.cloud.extraction.joint import NONE, PULL, Parts, half_spaces
from simplexmesh.cloud.extraction.working import NEIGHBORS, Working
from simplexmesh.cloud.fitting.describe import deferred_tests
from simplexmesh.data.primitives import Primitive, fit_of

AT_ONCE = 500_000
"""Points that are labeled together, for which 0.2 GB are needed."""


def labeled(work: Working, state: Parts, points: Array) -> Indices:
    """Return the labels (n,) of all points: of the primitives of those about them, the nearest one."""
    if len(points) == len(work.points):
        return state.labels
    tree, starts = cKDTree(work.points), range(0, len(points), AT_ONCE)
    return np.concatenate([_labeled(work, state, points[k : k + AT_ONCE], tree) for k in starts])


def _labeled(work: Working, state: Parts, points: Array, tree: cKDTree) -> Indices:
    """Return the labels (n,) of some points, by the tree of those that were looked at."""
    distance, near = tree.query(points, k=NEIGHBORS // 2, workers=-1)
    near = np.where(distance <= work.reach[near], state.labels.astype(np.int16)[near], -1).T.copy()
    best, labels = np.full(len(points), NONE), np.full(len(points), -1)
    halves = half_spaces(state)
    for k, primitive in enumerate(state.primitives):
        votes = (near == k).sum(axis=0, dtype=np.int8)
        at = np.flatnonzero(votes > 1)
        for point, way in halves[k]:
            at = at[(points[at] - point) @ way >= 0]
        distance = _kernels_growth.distances(primitive._surface, points, at)
        noise = state.noises[k]
        cost = (distance / noise) ** 2 / 2 + np.log(noise / work.noise) - 2 * PULL * votes[at]
        at, cost = at[cost < best[at]], cost[cost < best[at]]
        best[at], labels[at] = cost, k
    return labels


def described(primitive: Primitive, points: Array, rng: np.random.Generator) -> Primitive:
    """Return a primitive with how it fits points; whether that is valid is tested when asked for."""
    primitive = primitive.centered(points).aligned(points)
    tests = deferred_tests(primitive, points, np.ones(primitive.n_parameters, bool), rng)
    return primitive.with_fit(fit_of(primitive, points, tests=tests))
