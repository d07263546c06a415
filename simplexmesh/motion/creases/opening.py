"""Simplex meshes with edges along lines: the dual of triangles that are opened there, so that it has vertices on them.

The dual of a triangulation has its vertices within triangles. Where each edge on a line is opened to two triangles
between copies of its ends, one for each side, and each place where lines meet to a polygon, the vertices dual to these
are on the lines: two an edge, and at a corner of three lines one, with an edge along each.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, dot, norm
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.cut import CutSurface
from simplexmesh.motion.creases.paths import JOINED, Path

ARM = 1 / 3
"""Of an edge that ends at a corner, how far from it the next vertex is."""


class OpenedTriangles:
    """Closed triangles opened along lines, of which `middles` (t, 3, 3) are the places halfway along half-edges."""

    def __init__(self, cut: CutSurface, middles: Array) -> None:
        self.vertices, self.start, self.mates = cut.surface.vertices, cut.ends[:, 0], cut.mates
        self.sharp, self.middles = cut.sharp.ravel(), middles.reshape(-1, 3)
        turned = np.arange(cut.sharp.size).reshape(-1, 3)
        self.after, self.before = np.roll(turned, -1, axis=1).ravel(), np.roll(turned, 1, axis=1).ravel()
        self.degree = np.bincount(self.start[self.sharp], minlength=len(self.vertices))
        self.at_corner = self.sharp & (self.degree[self.start] > 2)
        to_next, to_last = (
            self.vertices[self.start[turn]] - self.vertices[self.start] for turn in (self.after, self.before)
        )
        smooth = np.flatnonzero(~self.sharp)
        pairs = smooth, self.after[self.mates[smooth]]
        graph = csr_array((np.ones(len(smooth), bool), pairs), shape=(len(self.start),) * 2)
        self.copies = connected_components(graph, directed=False)[1]  # of its start, the one that a half-edge leaves
        angles = np.arctan2(norm(cross(to_next, to_last)), dot(to_next, to_last))
        self.angles = np.bincount(self.copies, angles)
        self.triangles, self.places = [self.copies.reshape(-1, 3)], [self.vertices[cut.surface.faces].mean(axis=1)]
        self.count = cut.surface.n_faces  # of triangles, and of vertices of the mesh
        self.paths: list[Path] = []
        self.exits: dict[int, int] = {}  # the added triangle at its start, where lines meet, of a half-edge on one
        rows = np.flatnonzero(self.at_corner)
        for first in rows[np.unique(self.start[rows], return_index=True)[1]].tolist():
            self._open_corner(first)
        self.inner = np.concatenate(self.places)  # of triangles that are not along lines
        for chain in cut.chains:
            self._open_chain(chain)

    def mesh(self) -> SimplexMesh:
        """Return the dual."""
        owner = np.zeros(self.copies.max() + 1, np.int64)
        owner[self.copies] = self.start
        out = dual((self.vertices[owner], np.concatenate(self.triangles)), outward=False)
        return out.moved(np.concatenate(self.places))

    def _added(self, triangles: Array, places: Array) -> Indices:
        """Add triangles (k, 3) of copies, whose dual vertices are at places (k, 3); return their numbers."""
        first = self.count
        self.count += len(triangles)
        self.triangles.append(triangles)
        self.places.append(places)
        return np.arange(first, first + len(triangles))

    def _next(self, half_edge: int) -> int:
        """Return the next half-edge on a line, counter-clockwise around a vertex."""
        out = self.mates[self.before[half_edge]]
        while not self.sharp[out]:
            out = self.mates[self.before[out]]
        return int(out)

    def _open_corner(self, first: int) -> None:
        """Add a polygon between the copies of the start of a half-edge, where lines meet, in triangles around one."""
        vertex, order = self.start[first], [first]
        while (following := self._next(order[-1])) != order[0]:
            order.append(following)
        ring, k = self.copies[order], len(order)
        triangles = np.stack([np.full(k - 2, ring[0]), ring[1:-1], ring[2:]], axis=1)
        # vertices at one place would have no edges between them: each leans to the middle of its three lines
        ways = self.middles[order] - self.vertices[vertex]
        lean = JOINED * (ways[1:-1] + ways[2:] + ways[0]) / 3 if k > 3 else np.zeros((1, 3))
        numbers = self._added(triangles, self.vertices[vertex] + lean)
        self.exits |= dict(zip(order, [numbers[-1], numbers[0], *numbers], strict=True))
        place = np.repeat(self.vertices[[vertex]], 2, axis=0)
        self.paths += [Path(-1, numbers[i : i + 2], place, closed=False) for i in range(k - 3)]

    def _places_along(self, chain: Indices, back: Indices) -> Array:
        """Return the places (2k, 3) of the two vertices of each edge of a line.

        One is at the start, the other halfway; those next to a corner, which has one, are a part of the edge from it.
        """
        start, end, middle = self.vertices[self.start[chain]], self.vertices[self.start[back]], self.middles[chain]
        first = np.where(self.at_corner[chain], ARM, 0.0)[:, None]
        last = np.where(self.at_corner[back, None], 1 - ARM, 0.5 + 0.5 * first)
        one, two = start + 2 * first * (middle - start), middle + (2 * last - 1) * (end - middle)
        return np.stack([one, two], axis=1).reshape(-1, 3)

    def _open_chain(self, chain: Indices) -> None:
        """Add two triangles for each edge of a line, one at an end where nothing else is sharp, and the line's path."""
        back = self.mates[chain]
        here, there = self.copies[chain], self.copies[self.after[chain]]
        across, beyond = self.copies[self.after[back]], self.copies[back]
        wide = self.at_corner[chain] * (self.angles[here] - self.angles[across])
        wide += self.at_corner[back] * (self.angles[beyond] - self.angles[there])
        of_these, of_others = [here, across, beyond, here, beyond, there], [here, across, there, across, beyond, there]
        triangles = np.where(wide > 0, of_others, of_these).T.reshape(
            -1, 3
        )  # wider copies get one vertex there, not two
        places = self._places_along(chain, back)
        real = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        numbers = self._added(triangles[real], places[real])
        ends = [np.array([self.exits[h]] if h in self.exits else [], np.int64) for h in (int(chain[0]), int(back[-1]))]
        vertices = np.concatenate([ends[0], numbers, ends[1]])
        at = np.concatenate([self.inner[ends[0]], places[real], self.inner[ends[1]]])
        turned_back = len(vertices) > 1 and vertices[0] == vertices[-1]
        closed = bool(turned_back or self.degree[self.start[chain[0]]] == 2)
        vertices = vertices[: len(vertices) - int(turned_back)]
        if len(vertices) > 1:
            self.paths.append(Path(0, vertices, at[: len(vertices)], closed))
