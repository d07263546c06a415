"""Surfaces that touch along edges, taken apart into such as are manifold."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, dot, normalized
from simplexmesh.mesh._kernels import component_labels

ALIKE = 1e-9
"""Turns around an edge between triangles that are on each other."""


def separated(vertices: Array, faces: Indices) -> tuple[Indices, Indices]:
    """Return faces with vertices of their own for each surface that touches another, and the vertex each is a copy of.

    Around an edge of more than two triangles, each is joined to the next one on its inner side, first of its own
    body; what finds none has a border there (after Gueziec et al. 2001, Cutting and stitching). Edges of surfaces that
    touch at both ends too stay crowded if they have no vertex between.
    """
    mates = _mates(vertices, faces)
    corner, starts = np.arange(faces.size), faces.ravel()
    following = corner - corner % 3 + (corner + 1) % 3
    joined = np.flatnonzero(mates >= 0)
    alike = starts[joined] == starts[mates[joined]]  # one of the two triangles is turned over
    begin = np.where(alike, mates[joined], following[mates[joined]])
    end = np.where(alike, following[mates[joined]], mates[joined])
    rows, columns = np.concatenate([joined, following[joined]]), np.concatenate([begin, end])
    links = sparse.coo_matrix((np.ones(len(rows), dtype=bool), (rows, columns)), shape=(faces.size,) * 2)
    _, vertex = csgraph.connected_components(links, directed=False)
    _, first = np.unique(vertex, return_index=True)
    return vertex.reshape(-1, 3).astype(faces.dtype), starts[first]


def without_repeated(faces: Indices) -> Indices:
    """Return the faces without those of the same corners in the same order as one before."""
    turns = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    first = np.unique(np.take_along_axis(faces, turns, axis=1), axis=0, return_index=True)[1]
    return faces[np.sort(first)]


def _mates(vertices: Array, faces: Indices) -> Indices:
    """Return the opposite of each half-edge, -1 for none."""
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    _, edge, count = np.unique(low * len(vertices) + high, return_inverse=True, return_counts=True)
    mates = np.full(faces.size, -1)
    order = np.argsort(edge, kind="stable")
    pairs = order[count[edge[order]] == 2].reshape(-1, 2)
    mates[pairs] = pairs[:, ::-1]
    crowded = np.flatnonzero(count[edge] > 2)
    apex = np.roll(faces, 1, axis=1).ravel()[crowded]
    angle = _angles(vertices[low[crowded]], vertices[high[crowded]], vertices[apex])
    crowded = crowded[np.lexsort([starts[crowded] < ends[crowded], -angle])]  # an inner side ends where another begins
    body = component_labels(np.where(mates >= 0, mates // 3, -1).reshape(-1, 3).astype(np.int32))[crowded // 3]
    for name in (edge[crowded] * len(faces) + body, edge[crowded]):  # bodies may pass through each other there
        order = np.argsort(name, kind="stable")
        for group in np.split(crowded[order], np.flatnonzero(np.diff(name[order])) + 1):
            _join(group.tolist(), (starts[group] < ends[group]).tolist(), mates)
    return mates


def _angles(low: Array, high: Array, apex: Array) -> Array:
    """Return the turn of each apex around its edge, right-handed from one direction that all edges share."""
    axis = normalized(high - low)
    side = np.eye(3)[np.abs(axis).argmin(axis=1)]
    across = normalized(cross(axis, side))
    angle = np.arctan2(dot(apex - low, cross(axis, across)), dot(apex - low, across))
    return np.round(angle / (2 * np.pi * ALIKE)) % round(1 / ALIKE)


def _join(around: list[int], forward: list[bool], mates: Indices) -> None:
    """Join half-edges around one edge, by falling angle: each forward one to the next backward one that is free."""
    waiting: list[int] = []
    for again in (False, True):
        for half_edge, starts in zip(around, forward, strict=True):
            if starts and not again and mates[half_edge] < 0:
                waiting.append(half_edge)
            elif not starts and waiting and mates[half_edge] < 0:
                other = waiting.pop()
                mates[half_edge], mates[other] = other, half_edge
