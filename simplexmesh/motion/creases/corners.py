"""Corners of lines on a mesh: three leave a vertex by its edges, n leave n - 2 vertices that edges join."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.motion.creases.line import CreaseLine, at_distances
from simplexmesh.motion.creases.tracing import Tracing

AHEAD = 1.5
"""In mean edges along a line from its end: the direction in which it leaves."""

SEEDS = 4
"""Vertices near a corner from which it is tried."""

MOST_TREES = 300
"""Sets of vertices that are looked at, of all that grow: there are about three times as many for each more line."""

End = tuple[int, int]
"""A line, and whether its last end is meant."""


@dataclass(frozen=True)
class Corner:
    """Vertices of a mesh where lines meet, joined as a tree, and by which of them and next vertex each line leaves."""

    place: Array
    vertices: list[int]
    exits: dict[End, tuple[int, int]]


def corners(trace: Tracing, lines: Sequence[CreaseLine]) -> dict[End, Corner | None]:
    """Return the corner at each end of open lines, those with most lines found first; None where no vertex is free."""
    ends = [(k, last) for k, line in enumerate(lines) if not line.closed for last in (0, 1)]
    places = np.array([lines[k].points[-last] for k, last in ends]).reshape(-1, 3)
    _, node = np.unique(places, axis=0, return_inverse=True)
    meeting = [np.flatnonzero(node == i) for i in range(int(node.max(initial=-1)) + 1)]
    out: dict[End, Corner | None] = {}
    for rows in sorted(meeting, key=len, reverse=True):
        those = [ends[row] for row in rows]
        corner = _corner(trace, lines, places[rows[0]], those)
        out |= dict.fromkeys(those, corner)
    return out


def _corner(trace: Tracing, lines: Sequence[CreaseLine], place: Array, ends: list[End]) -> Corner | None:
    """Return the best corner for the ends of lines at a place, and take its vertices and those next to it."""
    towards = np.array([_ahead(lines[k].points[:: -1 if last else 1], AHEAD * trace.edge) for k, last in ends])
    vertices, neighbors = trace.mesh.vertices, trace.mesh.neighbors
    best, found = -np.inf, None
    for seed in trace.free(place)[:SEEDS]:
        near = neighbors[neighbors[neighbors[seed]]]  # one vertex of a corner may face anywhere
        normal = normalized(trace.mesh.normals[near].sum(axis=(0, 1, 2)))
        for chosen in _trees(trace, seed, max(len(ends) - 2, 1)):
            ways = _ways_out(neighbors, chosen)
            if len({way[1] for way in ways}) < max(len(ends), 3):
                continue
            middle = vertices[chosen].mean(axis=0)
            edges = vertices[[way[1] for way in ways]] - middle
            fit, match = _matched(edges, towards, normal)
            fit -= float(norm(middle - place)) / trace.edge + sum(trace.taken[ways[way][1]] for way in match)
            if fit > best:
                best, found = fit, Corner(place, chosen, {e: ways[way] for e, way in zip(ends, match, strict=True)})
    if found is not None:
        trace.taken[[*found.vertices, *(way[1] for way in found.exits.values())]] = True
    return found


def _trees(trace: Tracing, seed: int, size: int) -> list[list[int]]:
    """Return sets of so many free vertices that edges join to a seed as a tree, which is the first of each."""
    out, neighbors = [[seed]], trace.mesh.neighbors
    for _ in range(size - 1):
        grown = {
            (tree[0], *sorted([*tree[1:], n])): None
            for tree in out for v in tree for n in neighbors[v].tolist()
            if n not in tree and not trace.taken[n] and sum(m in tree for m in neighbors[n].tolist()) == 1
        }  # fmt: skip
        trees = [list(tree) for tree in grown]
        out = trees[:: 1 + len(trees) // MOST_TREES]
    return out


def _ways_out(neighbors: Indices32, chosen: Sequence[int]) -> list[tuple[int, int]]:
    """Return the edges out of some joined vertices, in order around them: the vertex, and the neighbor outside."""
    first = next((v, j) for v in chosen for j in range(3) if neighbors[v, j] not in chosen)
    out: list[tuple[int, int]] = []
    v, j = first
    while not out or (v, j) != first:
        beyond = int(neighbors[v, j])
        if beyond in chosen:
            v, j = beyond, int(np.flatnonzero(neighbors[beyond] == v)[0])
        else:
            out.append((v, beyond))
        j = (j + 1) % 3
    return out


def _ahead(points: Array, distance: float) -> Array:
    """Return the way (3,) from the first of some points to the place at a distance along them, or to the last."""
    far = np.append(0.0, np.cumsum(norm(np.diff(points, axis=0))))
    return at_distances(points, far, np.array([distance]))[0] - points[0]


def _matched(edges: Array, towards: Array, normal: Array) -> tuple[float, tuple[int, ...]]:
    """Return how well edges (m, 3), in order around a normal, lie along directions (k, 3), and which do best."""
    edges, towards = (normalized(each - dot(each, normal[None])[:, None] * normal) for each in (edges, towards))
    aside = np.cross(normal, edges[0])
    order = np.argsort(np.arctan2(towards @ aside, towards @ edges[0]))
    cosines = towards @ edges.T
    best: tuple[float, tuple[int, ...]] = -np.inf, ()
    for some in combinations(range(len(edges)), len(towards)):
        for turn in range(len(some)):
            match = np.empty(len(some), np.int64)
            match[order] = np.roll(some, turn)
            fit = float(cosines[np.arange(len(some)), match].sum())
            if fit > best[0]:
                best = fit, tuple(match.tolist())
    return best
