"""What closed triangles say about their tunnels: whether a line near them runs around one."""

from __future__ import annotations

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

DETOUR = 12.0
"""A line that runs along a surface is no more torn up on it than so, in edges."""

MOST = 40_000_000
"""Edges times loops of a basis that are kept in memory."""


class Walls:
    """A closed surface in one piece that tells how lines near it run around its handles and tunnels.

    Parameters
    ----------
    vertices : (v, 3) array of float
    faces : (t, 3) array of int
        Closed, oriented, in one piece.
    places : (v, 3) array of float, optional
        Where the tunnels are measured, when `vertices` are those of a surface some way around them.

    Raises
    ------
    TopologyError
        When the surface has a border, or triangles turned differently.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> donut = sm.torus(48, 24, tube_radius=0.4).triangulated()
    >>> walls = Walls(donut.vertices, donut.faces)
    >>> turn = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    >>> ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    >>> bool(walls.winding(0.6 * ring, 0.1).any()), bool(walls.winding(0.1 * ring + [0, 1.4, 0], 0.1).any())
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
    def _number(self) -> dict[tuple[int, int], tuple[int, int]]:
        out = {}
        for k, (a, b) in enumerate(self._cut.edges.tolist()):
            out[a, b], out[b, a] = (k, 1), (k, -1)
        return out

    def winding(self, line: Array, edge: float) -> Indices | None:
        """Return how often a closed line near the surface runs along each loop of a basis.

        Parameters
        ----------
        line : (k, 3) array of float
            In order.
        edge : float
            How large the steps of the line are thought to be.

        Returns
        -------
        (2 g,) array of int or None
            All 0 for a line that bounds a part of the surface; None for one that jumps from sheet to sheet.
        """
        limit = DETOUR * max(edge, self._edge)
        nearest = self._used[self._tree.query(_dense(line, 0.5 * max(edge, self._edge)))[1]]
        loop = nearest[nearest != np.roll(nearest, 1)]
        out = np.zeros(len(self._cut.generators), np.int64)
        for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True):
            way = self._way(a, b, limit)
            if way is None:
                return None
            for step in way:
                k, sign = self._number[step]
                out += sign * self._cut.forms[k]
        return out

    @cached_property
    def tunnels(self) -> tuple[Loop, ...]:
        """The shortest loops around the surface's own tunnels."""
        found = [measured(self._places, loop.vertices) for loop in loops_of(self._cut)]
        return tuple(sorted(found, key=lambda loop: loop.length))

    def along(self, loop: Indices) -> Indices:
        """Return how often a closed way along edges, by its vertices, runs along each loop of the basis."""
        out = np.zeros(len(self._cut.generators), np.int64)
        for step in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True):
            k, sign = self._number[step]
            out += sign * self._cut.forms[k]
        return out

    def _way(self, a: int, b: int, limit: float) -> list[tuple[int, int]] | None:
        """Return the steps of the shortest way between two vertices, None when it is longer than the limit."""
        if (a, b) in self._number:
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
    """Tell whether a winding is no sum of those known.

    Examples
    --------
    >>> a, b = np.eye(2, dtype=int)
    >>> independent([a], b), independent([a], 2 * a), independent([], 0 * a), independent([], None)
    (True, False, False, False)
    """
    return other is not None and bool(np.linalg.matrix_rank(np.array([*known, other])) > len(known))


def _dense(points: Array, step: float) -> Array:
    """Return points on a closed line at steps of no more than so much."""
    parts = []
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        part = np.arange(max(int(np.ceil(float(norm(b - a)) / step)), 1))[:, None]
        parts.append(a + part / len(part) * (b - a))
    return np.concatenate(parts)
