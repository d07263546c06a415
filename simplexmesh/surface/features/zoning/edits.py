"""Edits of zones, as labels of triangles."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh.surface.features.lines.edge_sets import Edges

MOST_SWEEPS = 100
"""Of smoothing; each shortens the boundaries, and few are needed."""


def by_size(labels: Indices, areas: Array) -> Indices:
    """Return the place (z,) of each zone, the largest first; labels need not be consecutive."""
    return np.argsort(np.lexsort((-np.bincount(labels, areas), np.bincount(labels) == 0)))


def in_pieces(labels: Indices, edges: Edges) -> Indices:
    """Return labels with unconnected parts of zones told apart."""
    return edges.zones(labels[edges.sides[:, 0]] != labels[edges.sides[:, 1]])


def connected(labels: Indices, edges: Edges) -> Indices:
    """Return labels with all but the largest piece of each zone given to the neighbors."""
    pieces, areas = in_pieces(labels, edges), edges.facets.areas
    owner = np.empty(pieces.max() + 1, np.int64)
    owner[pieces] = labels
    order = np.lexsort((-np.bincount(pieces, areas), owner))
    lesser = np.zeros(len(owner), bool)
    lesser[order[1:]] = np.diff(owner[order]) == 0
    return owner[dissolved(pieces, lesser, edges, np.zeros(len(edges.halves), bool))]


def dissolved(labels: Indices, gone: Mask, edges: Edges, closed: Mask) -> Indices:
    """Return labels with the triangles of some zones (z,) given to their neighbors, ring by ring.

    A triangle goes to the neighbor with which it shares the longest side; across closed sides only what cannot be
    reached across open ones.
    """
    labels, free = labels.copy(), gone[labels]
    one, two = edges.sides.T
    into = np.concatenate([np.stack([one, two], axis=1), np.stack([two, one], axis=1)])
    lengths, open_ones = np.tile(edges.lengths, 2), np.tile(~closed, 2)
    while free.any():
        usable = free[into[:, 0]] & ~free[into[:, 1]]
        usable = usable & open_ones if (usable & open_ones).any() else usable
        if not usable.any():
            break
        taken = into[usable][np.argsort(lengths[usable], kind="stable")]
        labels[taken[:, 0]] = labels[taken[:, 1]]
        free[taken[:, 0]] = False
    return labels


def without_small(labels: Indices, least: int, edges: Edges, closed: Mask) -> Indices:
    """Return labels with zones of fewer triangles given to their neighbors, none before a smaller one next to it."""
    while True:
        counts = np.bincount(labels)
        rank = np.empty(len(counts))
        rank[np.argsort(counts, kind="stable")] = np.arange(len(counts))
        one, two = labels[edges.sides].T
        lowest = np.full(len(counts), np.inf)
        np.minimum.at(lowest, one[one != two], rank[two[one != two]])
        np.minimum.at(lowest, two[one != two], rank[one[one != two]])
        gone = (counts < least) & (rank < lowest) & np.isfinite(lowest)
        if not gone.any():
            return labels
        labels = dissolved(labels, gone, edges, closed)


def smoothed(labels: Indices, edges: Edges, closed: Mask) -> Indices:
    """Return labels with single triangles exchanged where that shortens the open boundaries between zones."""
    labels = labels.copy()
    mates, length = edges.facets.mates, np.zeros(len(edges.facets.mates))
    barred = edges.halved(closed)
    length[edges.halves] = length[mates[edges.halves]] = edges.lengths
    for _ in range(MOST_SWEEPS):
        changed = 0
        border = np.unique(edges.sides[(labels[edges.sides[:, 0]] != labels[edges.sides[:, 1]]) & ~closed])
        for t in border.tolist():
            shared: dict[int, float] = {}
            for h in range(3 * t, 3 * t + 3):
                if mates[h] >= 0 and not barred[h]:
                    zone = int(labels[mates[h] // 3])
                    shared[zone] = shared.get(zone, 0.0) + float(length[h])
            own = shared.get(int(labels[t]), 0.0)
            best = max(shared, key=shared.__getitem__)
            if shared[best] > own * (1 + 1e-9):
                labels[t], changed = best, changed + 1
        if not changed:
            break
    return labels
