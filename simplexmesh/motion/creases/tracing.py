"""Lines being traced on a mesh: where they leave corners, and paths from vertex to vertex that keep near a line.

Three lines leave a vertex by its edges, n lines leave n - 2 vertices that edges join.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.line import CreaseLine, at_distances
from simplexmesh.motion.model.state import mean_edge

NEAR = 2.5
"""In mean edges, of the mesh or of the surface with the lines if those are longer: paths keep as close to them."""

DETOUR = 4.0
"""Cost of a step beside the line by an edge, in lengths of the step, less one."""

SHARED = 10.0
"""The same of a step to a vertex of another line."""

AHEAD = 1.5
"""In mean edges along a line from its end: the direction in which it leaves."""

SEEDS = 4
"""Vertices near a corner from which it is tried."""

MOST_TREES = 300
"""Sets of vertices that are looked at, of all that grow: there are about three times as many for each more line."""

End = tuple[int, int]
"""A line, and whether its last end is meant."""


class Tracing:
    """Lines being traced on a mesh; `taken` (n,) are the vertices on paths, at corners, and the first beyond them."""

    def __init__(self, mesh: SimplexMesh, resolution: float) -> None:
        self.mesh, self.edge = mesh, mean_edge(mesh)
        self.widest = NEAR * max(self.edge, resolution)
        self.taken = np.zeros(mesh.n_vertices, bool)
        self._ends = mesh.connectivity.edge_vertices.astype(np.int64)
        self._lengths = norm(mesh.vertices[self._ends[:, 0]] - mesh.vertices[self._ends[:, 1]])
        self._tree = cKDTree(mesh.vertices)

    def free(self, place: Array) -> list[int]:
        """Return the vertices near a place that are not taken, the nearest first."""
        near = np.asarray(self._tree.query_ball_point(place, self.widest), np.int64)
        near = near[~self.taken[near]]
        order: list[int] = near[np.argsort(norm(self.mesh.vertices[near] - place))].tolist()
        return order

    def leg(self, start: int, end: int, samples: Array, own: Sequence[int]) -> list[int]:
        """Return the vertices of the cheapest path from one to another near a line, beside its `own`; maybe none."""
        widest, vertices = self.widest, self.mesh.vertices
        near = ((vertices > samples.min(axis=0) - widest) & (vertices < samples.max(axis=0) + widest)).all(axis=1)
        near[own] = False
        near[[start, end]] = True
        rows = np.flatnonzero(near)
        away = np.minimum(cKDTree(samples).query(vertices[rows], distance_upper_bound=widest)[0], widest)
        number = np.full(len(vertices), -1)
        number[rows] = np.arange(len(rows))
        number[rows[(away == widest) & (rows != start) & (rows != end)]] = -1
        inside = np.flatnonzero((number[self._ends] >= 0).all(axis=1))
        a, b = number[self._ends[inside]].T
        shared = self.taken[rows] & (rows != start) & (rows != end)
        cost = 1 + DETOUR * (0.5 * (away[a] + away[b]) / self.edge) ** 2 + SHARED * (shared[a] * 1.0 + shared[b])
        graph = csr_array((self._lengths[inside] * cost, (a, b)), shape=(len(rows), len(rows)))
        _, before = dijkstra(graph, directed=False, indices=number[start], return_predecessors=True)
        at = [int(number[end])]
        while at[-1] != number[start]:
            if before[at[-1]] < 0:
                return []
            at.append(int(before[at[-1]]))
        out: list[int] = rows[at[::-1]].tolist()
        return out


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
