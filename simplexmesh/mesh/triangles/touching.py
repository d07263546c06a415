"""Closed bodies that touch along edges, told apart: each gets vertices of its own there."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import cross, dot

NEXT = np.array([1, 2, 0])


def told_apart(vertices: Array, faces: Indices) -> tuple[Indices, Indices]:
    """Return the vertex that each vertex of the result is a copy of, and its faces (t, 3); first are all as they were.

    Vertices are doubled at edges that four triangles or more share, as many in either direction; where these are of one
    body at both ends of the edge, and at all other edges, nothing changes.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    starts, half = faces.ravel(), np.arange(faces.size)
    ends, after = faces[:, NEXT].ravel(), half.reshape(-1, 3)[:, NEXT].ravel()
    opposite, rises, low, high = starts[after[after]], starts < ends, np.minimum(starts, ends), np.maximum(starts, ends)
    order = np.lexsort((high, low))
    same = (np.diff(low[order]) == 0) & (np.diff(high[order]) == 0)
    edge = np.append(0, np.cumsum(~same))
    shared = (np.bincount(edge) > 2) & (2 * np.bincount(edge, rises[order]) == np.bincount(edge))
    alike = np.flatnonzero(same & ~shared[edge[1:]])
    pairs, doubled = [np.stack([order[alike], order[alike + 1]], axis=1)], np.zeros(len(vertices), bool)
    crowded = order[shared[edge]]
    if not len(crowded):
        return np.arange(len(vertices)), faces
    for halves in np.split(crowded, np.flatnonzero(np.diff(edge[shared[edge]])) + 1):
        ends_there = np.array([low[halves[0]], high[halves[0]]])
        pairs.append(_wedges(vertices[ends_there], vertices[opposite[halves]], halves, rises[halves]))
        doubled[ends_there] = True
    joined = np.concatenate(pairs).T
    lower, upper = np.where(rises, half, after), np.where(rises, after, half)  # corners of each half-edge
    a, b = np.hstack([lower[joined], upper[joined]])
    linked = coo_array((np.ones(len(a), bool), (a, b)), shape=(faces.size, faces.size))
    _, fan = connected_components(linked, directed=False)
    at = np.flatnonzero(doubled[starts])
    fans, corner = np.unique(np.stack([starts[at], fan[at]]), axis=1, return_inverse=True)
    copy = np.append(False, np.diff(fans[0]) == 0)[: fans.shape[1]]
    corners = starts.copy()
    corners[at] = np.where(copy, len(vertices) - 1 + np.cumsum(copy), fans[0])[corner.reshape(-1)]
    return np.append(np.arange(len(vertices)), fans[0][copy]), corners.reshape(-1, 3)


def _wedges(edge: Array, opposite: Array, halves: Indices, rises: Mask) -> Indices:
    """Return pairs (k, 2) of half-edges on an edge (2, 3) with a body between them, given the corners opposite."""
    arms, along = opposite - edge[0], cross(edge[1] - edge[0], opposite[0] - edge[0])
    across = cross(along, edge[1] - edge[0])
    turn = np.argsort(np.arctan2(dot(arms, along), dot(arms, across)), kind="stable")
    depth = np.cumsum(np.where(rises[turn], -1, 1))  # a triangle that rises along the edge ends a body
    turn = np.roll(turn, -1 - int(depth.argmin()))
    return np.stack([halves[turn[~rises[turn]]], halves[turn[rises[turn]]]], axis=1)
