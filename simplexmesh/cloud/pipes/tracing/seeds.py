"""Points of a cloud that may lie on pipes: their neighbors' normals turn about one direction, and about that only."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh.numerics.plane_fits import planes

TRIED = 2000
"""Points that are looked at: one in some dozens on every pipe of a scene of a million."""

SIZES = (60, 250)
"""Neighbors whose normals are compared."""

TURNED = 0.02
"""Share of the normals' moments across their mean, at least: that of an arc of 30 degrees."""

ROUND = 0.3
"""Share along the axis over that around it, at most: of a sphere they are the same."""

MOST = 400_000
"""Points whose normals are estimated, at most, spread evenly over the cloud."""


def likely_picks(points: Array, rng: np.random.Generator) -> Indices:
    """Return points that may lie on pipes, the likeliest first."""
    some = np.arange(len(points)) if len(points) <= MOST else rng.choice(len(points), MOST, replace=False)
    normals, tree = planes(points[some]).normals, cKDTree(points[some], balanced_tree=False, compact_nodes=False)
    tried = rng.choice(len(some), min(TRIED, len(some)), replace=False)
    score = np.zeros(len(tried))
    count = min(max(SIZES), len(some))
    near = tree.query(points[some[tried]], k=[*range(1, count + 1)])[1]
    for size in SIZES:
        around = normals[near[:, :size]]
        moments = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", around, around) / around.shape[1])
        fine = (moments[:, 1] > TURNED) & (moments[:, 0] < ROUND * moments[:, 1])
        score = np.maximum(score, np.where(fine, moments[:, 1] - moments[:, 0], 0.0))
    order = np.argsort(-score)
    found: Indices = some[tried[order[score[order] > 0]]]
    return found
