"""Paths from vertex to vertex of a mesh that keep near a line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import mean_edge

NEAR = 2.5
"""In mean edges, of the mesh or of the surface with the lines if those are longer: paths keep as close to them."""

DETOUR = 4.0
"""Cost of a step beside the line by an edge, in lengths of the step, less one."""

SHARED = 10.0
"""The same of a step to a vertex of another line."""


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
