"""Sets of a surface's edges: the lines they form, and what cleans them up."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.mesh._kernels import component_labels
from simplexmesh.surface.features.lines import _kernels_chains
from simplexmesh.surface.features.lines.facets import Facets

STEEP, MANY = 1.2, 14
"""Mean bend, in radians, beside a strip that is a face of its own, as one crease would turn by twice that, and the
least triangles of one: noise turns single ones by as much."""


class Chains(NamedTuple):
    """Lines of edges."""

    offsets: Indices
    """(c + 1,): the edges of line k are `edges[offsets[k] : offsets[k + 1]]`."""

    edges: Indices
    """(m,), in order."""

    vertices: Indices
    """(m + c,): the vertices along them, one more for each line; the last is the first where it closes."""

    @property
    def n_lines(self) -> int:
        """The number of lines."""
        return len(self.offsets) - 1

    def of(self, k: int) -> Indices:
        """Return the edges of a line."""
        return self.edges[self.offsets[k] : self.offsets[k + 1]]

    def along(self, k: int) -> Indices:
        """Return the vertices of a line."""
        return self.vertices[self.offsets[k] + k : self.offsets[k + 1] + k + 1]

    @property
    def ends(self) -> Indices:
        """(c, 2): the first and last vertex of each."""
        k = np.arange(len(self.offsets) - 1)
        return np.stack([self.vertices[self.offsets[:-1] + k], self.vertices[self.offsets[1:] + k]], axis=1)

    def total(self, values: Array) -> Array:
        """Return the sum (c,) along each line of values (e,) of all edges."""
        return np.add.reduceat(values[self.edges], self.offsets[:-1]) if len(self.edges) else np.zeros(0)

    def mean(self, values: Array) -> Array:
        """Return the mean (c,) along each line of values (e,) of all edges."""
        return self.total(values) / np.diff(self.offsets)


@dataclass(frozen=True, eq=False)
class Edges:
    """The inner edges of a surface. Sets of them are masks (e,)."""

    facets: Facets

    @cached_property
    def halves(self) -> Indices:
        """(e,): the first half-edge of each."""
        mates = self.facets.mates
        return np.flatnonzero(mates > np.arange(len(mates)))

    @cached_property
    def ends(self) -> Indices:
        """(e, 2): the vertices."""
        after = self.halves - self.halves % 3 + (self.halves + 1) % 3
        corners = self.facets.faces.ravel()
        return np.stack([corners[self.halves], corners[after]], axis=1)

    @cached_property
    def sides(self) -> Indices:
        """(e, 2): the triangles."""
        return np.stack([self.halves, self.facets.mates[self.halves]], axis=1) // 3

    @cached_property
    def lengths(self) -> Array:
        """(e,)."""
        start, end = self.facets.vertices[self.ends].transpose(1, 0, 2)
        return norm(end - start)

    @cached_property
    def border(self) -> Mask:
        """(n,): the vertices on borders, where lines end without being free."""
        out, half = np.zeros(len(self.facets.vertices), bool), np.flatnonzero(self.facets.mates < 0)
        corners = self.facets.faces.ravel()
        out[corners[half]] = out[corners[half - half % 3 + (half + 1) % 3]] = True
        return out

    @cached_property
    def _around(self) -> tuple[Indices, Indices]:
        """CSR (offsets, edges) of the edges at each vertex."""
        order = np.argsort(self.ends.ravel(), kind="stable")
        counts = np.bincount(self.ends.ravel(), minlength=len(self.facets.vertices))
        return np.concatenate([[0], np.cumsum(counts)]), order // 2

    def at(self, vertex: int) -> list[int]:
        """Return the edges at a vertex."""
        offsets, edges = self._around
        found: list[int] = edges[offsets[vertex] : offsets[vertex + 1]].tolist()
        return found

    def other(self, edge: int, vertex: int) -> int:
        """Return the other end of an edge."""
        a, b = self.ends[edge]
        return int(b if a == vertex else a)

    def halved(self, chosen: Mask) -> Mask:
        """Return the half-edges (3t,) of edges."""
        out = np.zeros(len(self.facets.mates), bool)
        out[self.halves[chosen]] = out[self.facets.mates[self.halves[chosen]]] = True
        return out

    def degrees(self, chosen: Mask) -> Indices:
        """Return how many of the chosen edges meet in each vertex (n,)."""
        return np.bincount(self.ends[chosen].ravel(), minlength=len(self.facets.vertices))

    def free(self, chosen: Mask) -> Mask:
        """Return the vertices (n,) inside the surface where a single one of the chosen edges ends."""
        out: Mask = (self.degrees(chosen) == 1) & ~self.border
        return out

    def zones(self, chosen: Mask) -> Indices:
        """Return labels (t,) of the parts of the surface between edges, in the order of the triangles."""
        mates = self.facets.mates
        beside = np.where((mates < 0) | self.halved(chosen), -1, mates // 3).reshape(-1, 3)
        return component_labels(beside.astype(np.int32)).astype(np.int64)

    def chains(self, chosen: Mask, nodes: Mask | None = None) -> Chains:
        """Return the lines that edges form, from node to node, then the closed ones.

        Nodes are vertices where other than two edges meet, those on borders, and those given (n,).
        """
        degrees = np.where(self.border if nodes is None else self.border | nodes, 0, self.degrees(chosen))
        return Chains(*_kernels_chains.chains(self.ends, *self._around, chosen, degrees))

    def without_weakest(
        self, chosen: Mask, strength: Callable[[Chains], Array], weak: Callable[[Indices], Indices] = np.asarray
    ) -> Mask:
        """Return edges without the `weak` ones of lines of strengths (c,) below 0, the weakest first."""
        chosen = chosen.copy()
        while True:
            lines = self.chains(chosen)
            strengths = strength(lines)
            met: set[int] = set()
            for k in np.argsort(strengths)[: np.count_nonzero(strengths < 0)]:
                ends = set(lines.ends[k].tolist())
                if not met & ends:
                    met |= ends
                    chosen[weak(lines.of(k))] = False
            if not met:
                return chosen

    def trimmed(self, chosen: Mask, weak: Mask) -> Mask:
        """Return edges without the weak ones up to the first that is not, from free ends on."""
        while (gone := chosen & weak & self.free(chosen)[self.ends].any(axis=1)).any():
            chosen = chosen & ~gone
        return chosen

    def pruned(self, chosen: Mask, shortest: Array) -> Mask:
        """Return edges without lines that end freely and are shorter than the mean of `shortest` (e,) along them."""

        def strength(lines: Chains) -> Array:
            free = self.free(np.isin(np.arange(len(chosen)), lines.edges))[lines.ends].any(axis=1)
            return np.where(free, lines.total(self.lengths) - lines.mean(shortest), 1.0)

        return self.without_weakest(chosen, strength)

    def without_small(self, chosen: Mask, strengths: Array, bends: Array, kept: Mask) -> Mask:
        """Return edges without the weakest side of each zone with all vertices but one on them, and no triangle `kept`.

        Such strips are the straddling triangles between two courses of one crease, which share its angle. Rims of walls
        and steps, as narrow, have the `bends` (e,) of a crease on either side.

        Those with the weakest sides are merged first, each with one neighbor at a time, until none is left.
        """
        chosen = chosen.copy()
        while True:
            labels = self.zones(chosen)
            zone = np.zeros(len(self.facets.vertices), np.int64)
            zone[self.facets.faces] = labels[:, None]
            inside = np.bincount(zone, self.degrees(chosen) == 0, labels.max() + 1)
            small = (inside < 2) & (np.bincount(labels, kept) == 0)
            edges = np.flatnonzero(chosen)
            pair = np.sort(labels[self.sides[edges]], axis=1)
            apart = pair[:, 0] != pair[:, 1]
            edges, pair = edges[apart], pair[apart]
            pairs, which = np.unique(pair, axis=0, return_inverse=True)
            which = which.ravel()
            weights = self.lengths[edges]
            excess = np.bincount(pair.ravel(), np.repeat((bends[edges] - STEEP) * weights, 2), len(small))
            small &= (excess < 0) | (np.bincount(labels) < MANY)
            means = np.bincount(which, strengths[edges] * weights) / np.maximum(np.bincount(which, weights), 1e-300)
            merged: set[int] = set()
            for k in np.argsort(means):
                two = pairs[k].tolist()
                if small[two].any() and not merged & set(two):
                    merged |= set(two)
                    chosen[edges[which == k]] = False
            if not merged:
                return chosen

    def bridged(self, chosen: Mask, costs: Array, most: Array) -> Mask:
        """Return edges with each free end led to a line nearby by the cheapest path, of cost (e,) up to `most` (n,)."""
        chosen, unchosen, degrees = chosen.copy(), ~chosen, self.degrees(chosen)
        free, own = np.flatnonzero(self.free(chosen)), self.ends[chosen].ravel()
        last = np.bincount(own, np.repeat(self.lengths[chosen], 2), len(degrees))
        for end in free[np.argsort(last[free])].tolist():
            if degrees[end] == 1:
                path = self._bridge(end, chosen, unchosen, degrees, costs, float(most[end]))
                chosen[path], unchosen[path] = True, False
                np.add.at(degrees, self.ends[path].ravel(), 1)
        return chosen

    def path(self, start: int, goals: list[int], usable: Mask, costs: Array) -> list[int]:
        """Return the edges of the cheapest path from a vertex to one of others, none if there is no path."""
        came: dict[int, int] = {}
        for vertex, _ in self._reached(start, usable, costs, np.inf, came):
            if vertex in goals and vertex != start:
                return self._walked(start, vertex, came)
        return []

    def _walked(self, start: int, vertex: int, came: dict[int, int]) -> list[int]:
        """Return the edges by which a vertex was reached."""
        path = []
        while vertex != start:
            path.append(came[vertex])
            vertex = self.other(came[vertex], vertex)
        return path

    def _bridge(self, end: int, chosen: Mask, unchosen: Mask, degrees: Indices, costs: Array, most: float) -> list[int]:
        """Return the edges that lead from a free end to the nearest line that is not, along lines, almost as near."""
        own, came = dict(self._reached(end, chosen, self.lengths, 3 * most, {})), dict[int, int]()
        for vertex, _ in self._reached(end, unchosen, costs, most, came):
            if vertex == end or not degrees[vertex]:
                continue
            path = self._walked(end, vertex, came)
            if own.get(vertex, np.inf) > 3 * self.lengths[path].sum():
                return path
        return []

    def _reached(
        self, start: int, usable: Mask, costs: Array, most: float, came: dict[int, int]
    ) -> Iterator[tuple[int, float]]:
        """Yield vertices reached along usable edges and costs, the cheapest first; `came` gets the edges to them."""
        reached, queue = {start: 0.0}, [(0.0, start)]
        while queue:
            cost, vertex = heapq.heappop(queue)
            if cost > reached[vertex]:
                continue
            yield vertex, cost
            for edge in self.at(vertex):
                more = cost + float(costs[edge])
                if not usable[edge] or more > most:
                    continue
                other = self.other(edge, vertex)
                if more < reached.get(other, np.inf):
                    reached[other], came[other] = more, edge
                    heapq.heappush(queue, (more, other))
