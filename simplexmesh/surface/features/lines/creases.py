"""The edges of a surface along its creases: where the normal jumps by more than noise and curvature explain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm
from simplexmesh.surface.features.lines import _kernels_jumps
from simplexmesh.surface.features.lines.edge_sets import Chains, Edges
from simplexmesh.surface.features.lines.normals import sampled, within_zones

DEFAULT_ANGLE = np.radians(10)
"""A crease by default; the normal of tessellated curves jumps by less. Noise leaves filtered normals a tenth."""

STRONG = 0.7
"""Bends that windows do not cross, in radians: curves are seldom tessellated by more than 40 degrees a step."""

STANDING_OUT = 5.0
"""Jumps in the mean of whole lines over the median of those at ordinary edges: of ripples, say, or coarse curves."""

ROUND = 0.35
"""In radians: a jump by less may be that of a side which bends by as much over an edge, as fillets do."""

FILLET, STEEP = 1.3, 1.3
"""A line on a fillet jumps by less than both sides bend over so many edges, in narrow windows; and by less than this,
in radians, in wide ones, where a crease shows all of its angle."""

FEW = 0.25
"""Share of edges beside normals that are not exact, below which these do not tell an ordinary jump: rims alone."""

VISIBLE = 0.05
"""In edges of the mesh: where noise is less, curvature rather than noise is what makes normals jump."""

SHARP = 0.8
"""A jump, in radians, that stands out on simplified surfaces, whose slivers along creases say little themselves."""

ROUNDS = 2
"""Of finding jumps: in the second, windows see past what was none in the first."""

EDGE = 0.8
"""Share of what whole lines need that a single edge must have."""

NEAR, ASTRIDE = 0.1, 0.003
"""Weights of triangles that may straddle a crease, and of those that do: at lines known to be off it."""

OFF = 0.2
"""In edges of the mesh: lines whose edges are off their crease by less follow it."""

BIAS = 0.8
"""Of the angle, what triangles that straddle a crease leave of it while it is looked for."""

SAMPLE = 1000
"""Edges at which the ordinary jump is measured."""

SHORTEST, GAP = 7.0, 6.0
"""In edges of the mesh: the shortest line with a free end, and the longest gap closed."""


@dataclass(frozen=True, eq=False)
class FilteredSurface:
    """A surface with normals without the noise of its vertices."""

    edges: Edges
    normals: Array
    """(t, 3)."""

    exact: Mask
    """(t,): the triangles whose normals are those of the surface as they are."""

    @cached_property
    def bends(self) -> Array:
        """The angles (e,) between the normals of the triangles at edges."""
        one, two = self.normals[self.edges.sides].transpose(1, 0, 2)
        return np.arccos(np.clip(dot(one, two), -1.0, 1.0))

    @cached_property
    def scales(self) -> Array:
        """The lengths (e,) that measure short lines and gaps: the mesh's edges there, 0 where all is exact."""
        scales: Array = self.edges.facets.scales[self.edges.sides].mean(axis=1)
        scales[self.exact[self.edges.sides].all(axis=1)] = 0.0
        return scales

    @property
    def tilts(self) -> Array:
        """The noise (e,) at edges over the edges of the mesh there, at least what is `VISIBLE`."""
        facets = self.edges.facets
        shares: Array = np.maximum(facets.noise / np.maximum(facets.scales, 1e-300), VISIBLE)[self.edges.sides]
        return shares.mean(axis=1)

    def straddling(self, chosen: Mask) -> Mask:
        """Return which triangles (t,) may be on both sides of a crease: those at chosen edges, but exact ones."""
        touched = np.zeros(len(self.edges.facets.vertices), bool)
        touched[self.edges.ends[chosen]] = True
        out: Mask = touched[self.edges.facets.faces].any(axis=1) & ~self.exact
        return out

    def jumps_at(self, at: Mask, stops: Mask, off: Mask | None = None) -> tuple[Array, Array, Array, Array]:
        """Return jumps (e,) of the normal, places and directions (e, 3) and bendings (e,) `at` some edges, 0 elsewhere.

        Triangles that may straddle these edges have little weight, at those that are `off` hardly any; no window
        crosses those that are `stops`.
        """
        weights, stops = np.where(self.straddling(at), NEAR, 1.0), self.edges.halved(stops)
        if off is not None:
            weights[self.straddling(off)] = ASTRIDE
        sides = _kernels_jumps.Sides(self.normals, weights, self.exact, stops)
        rows = np.flatnonzero(at)
        out = np.zeros(len(at)), np.zeros((len(at), 3)), np.zeros((len(at), 3)), np.zeros(len(at))
        filled = tuple(values[rows] for values in out)
        _kernels_jumps.fill_jumps(self.edges.facets, sides, self.edges.halves[rows], *filled)
        for values, those in zip(out, filled, strict=True):
            values[rows] = those
        return out

    def creases_at(self, chosen: Mask) -> Creases:
        """Return the creases at edges that form clean lines, which no window crosses."""
        normals, beside = self.normals.copy(), np.unique(self.edges.sides[chosen])
        beside = beside[~self.exact[beside]]
        normals[beside] = within_zones(self.edges.facets, self.edges.zones(chosen), beside)
        settled = FilteredSurface(self.edges, normals, self.exact)
        biased, *first, _ = settled.jumps_at(chosen, chosen)
        found = Creases(self.edges, self.normals, self.exact, settled, chosen, biased, biased, *first)
        jumps, places, directions, _ = settled.jumps_at(chosen, chosen, found.off)
        return replace(found, jumps=jumps, places=places, directions=directions)


@dataclass(frozen=True, eq=False)
class Creases(FilteredSurface):
    """Edges along creases, with what was measured there; arrays have one row for each inner edge of the surface."""

    settled: FilteredSurface
    """The surface with normals of zones beside the creases, of which no window crosses one."""

    chosen: Mask
    biased: Array
    """Jumps as they are found, with some of what straddles them."""

    jumps: Array
    places: Array
    directions: Array

    @cached_property
    def off(self) -> Mask:
        """The edges (e,) of lines that are not on their creases, on the whole, but straddled by triangles."""
        edges, out = self.edges, np.zeros(len(self.chosen), bool)
        if edges.facets.simplified:
            return out
        lines = edges.chains(self.chosen)
        away = norm(self.places - edges.facets.vertices[edges.ends].mean(axis=1))
        off = lines.mean(away / edges.facets.scales[edges.sides].mean(axis=1)) > OFF
        out[lines.edges[np.repeat(off, np.diff(lines.offsets))]] = True
        return out

    def areas_beside(self, weight: float) -> Array:
        """Return the areas (t,), times a weight where triangles may straddle a crease."""
        return self.edges.facets.areas * np.where(self.straddling(self.chosen), weight, 1.0)


def creases(vertices: Array, faces: Indices, mates: Indices, angle: float) -> Creases:
    """Return the edges where two smooth parts of a surface meet at more than an angle."""
    facets, normals, exact = sampled(vertices, faces, mates)
    surface = FilteredSurface(Edges(facets), normals, exact)
    chosen, strengths = surface.bends > 0.5 * min(DEFAULT_ANGLE, angle), surface.bends
    biased = max(min(DEFAULT_ANGLE, angle), BIAS * angle)
    ordinary = np.maximum(biased, STANDING_OUT * _ordinary_jumps(surface))
    for _ in range(ROUNDS):
        strengths, least = _measured(surface, chosen, strengths, ordinary)
        chosen = chosen & (strengths > EDGE * least)
    found = surface.creases_at(_cleaned(surface, chosen, strengths, ordinary, least))
    if not surface.edges.facets.simplified and (found.chosen != (kept := _without_fillets(found))).any():
        found = surface.creases_at(kept)

    def strength(lines: Chains) -> Array:
        return np.minimum(lines.mean(found.jumps) - angle, lines.mean(found.biased) - biased)

    chosen = found.edges.without_weakest(found.chosen, strength)
    chosen = found.edges.trimmed(chosen, found.jumps < EDGE * angle)
    chosen = found.edges.pruned(chosen, SHORTEST * found.scales)
    return replace(found, chosen=chosen)


def _ordinary_jumps(surface: FilteredSurface) -> Array:
    """Return the jump (e,) that is ordinary: the median at edges whose triangles' normals are not exact, from a sample.

    It is 0 if few are such. Noise turns small triangles by more than large ones, so each edge has the median of
    jumps over that, times that: over noise to the size of the triangles around, on simplified surfaces to the shape of
    its own, and there sharp edges are no ordinary ones.
    """
    edges, sharp, simplified = surface.edges, surface.bends > STRONG, surface.edges.facets.simplified
    inexact = np.logical_not(surface.exact[edges.sides].any(axis=1))
    vague = np.flatnonzero(inexact & ~(simplified & sharp))
    if not len(vague) or np.count_nonzero(inexact) < FEW * len(inexact):
        return np.zeros(len(sharp))
    some = np.zeros(len(sharp), bool)
    some[vague[np.argsort(edges.lengths[vague])][:: max(1, len(vague) // SAMPLE)]] = True  # in any numbering the same
    jumps = np.abs(surface.jumps_at(some, sharp)[0])
    tilts = norm(edges.facets.tilts[edges.sides]) if simplified else surface.tilts
    ordinary: Array = tilts * np.median(jumps[some] / tilts[some])
    return np.minimum(ordinary, SHARP / STANDING_OUT) if simplified else ordinary


def _measured(surface: FilteredSurface, at: Mask, strengths: Array, ordinary: Array) -> tuple[Array, Array]:
    """Return the jumps (e,) `at` some edges, past those of known strengths, and by how much a crease jumps there."""
    jumps, *_, bendings = surface.jumps_at(at, strengths > STRONG)
    return jumps, np.maximum(ordinary, np.minimum(ROUND, surface.scales * bendings))


def _cleaned(surface: FilteredSurface, chosen: Mask, jumps: Array, ordinary: Array, least: Array) -> Mask:
    """Return edges as clean lines: gaps closed, duplicates and crumbs gone, each line a crease on the whole."""
    edges, scales, kept = surface.edges, surface.scales, surface.exact | surface.edges.facets.simplified
    costs = edges.lengths * np.maximum(0.1, 1 - surface.bends / np.radians(20))
    most = np.zeros(len(edges.facets.vertices))
    np.maximum.at(most, edges.ends.ravel(), np.repeat(GAP * scales, 2))

    for bridging in (True, True, False):
        chosen = _without_weak_parts(edges, chosen, (jumps - least) * edges.lengths, 2 * SHORTEST * scales)
        chosen = edges.without_small(chosen, jumps, surface.bends, kept)
        chosen = edges.pruned(chosen, SHORTEST * scales)
        if bridging:
            bridges = edges.bridged(chosen, costs, most) & ~chosen
            chosen = chosen | bridges
            there = _measured(surface, bridges, jumps, ordinary)
            jumps, least = np.where(bridges, there, (jumps, least))
    return chosen


def _without_fillets(found: Creases) -> Mask:
    """Return edges without lines on fillets, past which windows see that noise widens; short ones tell little."""
    edges, facets, shortest = found.edges, found.edges.facets, SHORTEST * found.scales
    narrow = replace(found.settled, edges=Edges(facets._replace(noise=np.zeros_like(facets.noise))))
    jumps, *_, bendings = narrow.jumps_at(found.chosen, found.chosen)
    lines, excess = edges.chains(found.chosen), np.zeros(len(found.chosen))
    telling = (lines.total(edges.lengths) > lines.mean(shortest)) & (lines.mean(found.jumps) < STEEP)
    those = lines.edges[np.repeat(telling, np.diff(lines.offsets))]
    excess[those] = ((jumps - FILLET * bendings * found.scales) * edges.lengths)[those]
    return edges.pruned(_without_weak_parts(edges, found.chosen, excess, 2 * shortest), shortest)


def _without_weak_parts(edges: Edges, chosen: Mask, excess: Array, shortest: Array) -> Mask:
    """Return edges without lines whose excess (e,) is below 0, but for the rest of those with one weak part.

    The weak part is the one with the least excess; what is left on either side is as long as `shortest` (e,), or gone.
    """

    def weak(line: Indices) -> Indices:
        sums = np.concatenate([[0.0], np.cumsum(excess[line])])
        far = np.concatenate([[0.0], np.cumsum(edges.lengths[line])])
        stop = 1 + int(np.argmin((sums - np.maximum.accumulate(sums))[1:]))
        start, least = int(np.argmax(sums[:stop])), shortest[line].mean()
        return line[start * (far[start] >= least) : stop if far[-1] - far[stop] >= least else len(line)]

    def strength(lines: Chains) -> Array:
        return lines.total(excess) / np.maximum(lines.total(edges.lengths), 1e-300)

    return edges.without_weakest(chosen, strength, weak)
