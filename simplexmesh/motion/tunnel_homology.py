"""Homology classes of closed lines near a triangulated surface, which tell whether they run around its tunnels."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from simplexmesh._vec import norm
from simplexmesh.mesh.homology import Cut, cut_open
from simplexmesh.mesh.loops import Loop, loops_of, measured

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MAX_STEP = 12.0
"""In edges: consecutive points of a line along the surface project to vertices no farther apart on it."""

MOST = 40_000_000
"""Maximum size of the table of a homology basis, edges times loops, that is kept in memory."""


class TunnelHomology:
    """A basis of the first homology of a closed connected surface, and the classes of lines in it.

    Parameters
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
        Closed, oriented and connected.
    places : (v, 3) array of float, optional
        Positions at which tunnels are measured, when `vertices` are those of an offset surface.

    Raises
    ------
    TopologyError
        When the surface has a border or is not oriented consistently.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> donut = sm.torus(48, 24, tube_radius=0.4).triangulated()
    >>> homology = TunnelHomology(donut.vertices, donut.faces)
    >>> turn = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    >>> ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    >>> bool(homology.winding(0.6 * ring, 0.1).any()), bool(homology.winding(0.1 * ring + [0, 1.4, 0], 0.1).any())
    (True, False)
    """

    def __init__(self, vertices: Array, faces: Indices, places: Array | None = None) -> None:
        self._cut: Cut = cut_open(vertices, faces)
        self._places = vertices if places is None else places
        self._edge = float(self._cut.lengths.mean())
        self._used = np.unique(faces)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._cut.vertices[self._used])

    @cached_property
    def _signed_edges(self) -> dict[tuple[int, int], tuple[int, int]]:
        out = {}
        for k, (a, b) in enumerate(self._cut.edges.tolist()):
            out[a, b], out[b, a] = (k, 1), (k, -1)
        return out

    def winding(self, line: Array, edge: float) -> Indices | None:
        """Return the homology class of a closed line near the surface: how often it runs along each loop of the basis.

        Parameters
        ----------
        line : (k, 3) array of float
            Points in order.
        edge : float
            Length scale of the line, by which it is subdivided.

        Returns
        -------
        (2 g,) array of int or None
            All 0 for a line that bounds a part of the surface; None for one that jumps between sheets of it.
        """
        limit = MAX_STEP * max(edge, self._edge)
        steps: list[tuple[int, int]] = []
        nearest = self._used[self._tree.query(_subdivided(line, 0.5 * max(edge, self._edge)))[1]]
        loop = nearest[nearest != np.roll(nearest, 1)]
        for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True):
            path = self._path(a, b, limit)
            if path is None:
                return None
            steps += path
        return self._sum(steps)

    @cached_property
    def tunnels(self) -> tuple[Loop, ...]:
        """The shortest loops around the tunnels of the surface, by length."""
        found = [measured(self._places, loop.vertices) for loop in loops_of(self._cut)]
        return tuple(sorted(found, key=lambda loop: loop.length))

    def winding_of_path(self, loop: Indices) -> Indices:
        """Return the homology class of a closed path of edges, given by its vertices."""
        return self._sum(zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True))

    def _sum(self, steps: Iterable[tuple[int, int]]) -> Indices:
        """Return the sum (2 g,) of the cohomology basis over directed edges."""
        out = np.zeros(len(self._cut.generators), np.int64)
        for step in steps:
            k, sign = self._signed_edges[step]
            out += sign * self._cut.forms[k]
        return out

    def _path(self, a: int, b: int, limit: float) -> list[tuple[int, int]] | None:
        """Return the edges of the shortest path between two vertices, None when it is longer than the limit."""
        if (a, b) in self._signed_edges:
            return [(a, b)]
        far, parent = dijkstra(self._cut.graph, indices=a, limit=limit, return_predecessors=True)
        if not np.isfinite(far[b]):
            return None
        steps = []
        while b != a:
            steps.append((int(parent[b]), b))
            b = int(parent[b])
        return steps


def independent(known: list[Indices], other: Indices | None) -> bool:
    """Return whether a homology class is linearly independent of those known.

    Examples
    --------
    >>> a, b = np.eye(2, dtype=int)
    >>> independent([a], b), independent([a], 2 * a), independent([], 0 * a), independent([], None)
    (True, False, False, False)
    """
    return other is not None and bool(np.linalg.matrix_rank(np.array([*known, other])) > len(known))


def _subdivided(points: Array, step: float) -> Array:
    """Return points on a closed line, no farther than `step` apart."""
    parts = []
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        part = np.arange(max(int(np.ceil(float(norm(b - a)) / step)), 1))[:, None]
        parts.append(a + part / len(part) * (b - a))
    return np.concatenate(parts)
