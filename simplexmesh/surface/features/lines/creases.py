"""The edges of a surface along its creases: where the normal jumps by more than noise and curvature explain."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot
from simplexmesh.surface.features.lines import _kernels_jumps
from simplexmesh.surface.features.lines.edges import Chains, Edges
from simplexmesh.surface.features.lines.normals import sampled, within_zones

DEFAULT_ANGLE = np.radians(10)
"""A crease by default; the normal of tessellated curves jumps by less."""

CANDIDATE = np.radians(5)
"""Bends of the filtered normals that are looked at; noise alone leaves less than one degree."""

STRONG = 0.7
"""Bends that windows do not cross, in radians: curves are seldom tessellated by more than 40 degrees a step."""

STANDING_OUT = 4.0
"""Jumps in the mean of whole lines over the median of those at ordinary edges: of ripples, say, or coarse curves."""

ROUNDS = 2
"""Of finding jumps: in the second, windows see past what was none in the first."""

MANY = 0.1
"""Of the edges: so many must be without exact normals to be ordinary; in files of CAD those left are at creases."""

EDGE = 0.8
"""Share of what whole lines need that a single edge must have."""

SAMPLE = 1000
"""Edges at which the ordinary jump is measured."""

FEWEST = 8
"""Triangles of a zone between lines: fewer are the straddling triangles between two courses of one crease."""

SHORTEST, GAP = 7.0, 6.0
"""In edges of the mesh: the shortest line with a free end, and the longest gap closed."""


@dataclass(frozen=True, eq=False)
class Creases:
    """Edges along creases, with what was measured there; arrays have one row for each inner edge of the surface."""

    edges: Edges
    noise: float
    normals: Array
    exact: Mask
    chosen: Mask
    jumps: Array
    places: Array
    directions: Array

    def areas_beside(self, weight: float) -> Array:
        """Return the areas (t,), times a weight where triangles touch a chosen edge and may straddle it."""
        facets = self.edges.facets
        return facets.areas * np.where(_touching(self.edges, self.chosen) & ~self.exact, weight, 1.0)


def creases(vertices: Array, faces: Indices, mates: Indices, angle: float) -> Creases:
    """Return the edges where two smooth parts of a surface meet at more than an angle."""
    facets, noise, normals, exact = sampled(vertices, faces, mates)
    edges = Edges(facets)
    bends = bent(normals, edges.sides)
    chosen = bends > min(CANDIDATE, 0.5 * angle)
    least = max(angle, STANDING_OUT * _ordinary_jump(edges, normals, noise, exact, bends))
    strengths = bends
    for _ in range(ROUNDS):
        jumps, _, _ = _jumps(edges, normals, noise, exact, chosen, strengths)
        chosen = chosen & (jumps > EDGE * least)
        strengths = jumps
    chosen = _cleaned(edges, chosen, jumps, bends, least, exact)
    settled = _settled(edges, normals, noise, exact, chosen)
    chosen = edges.without_weakest(chosen, lambda lines: lines.mean(settled[0]) - angle)
    chosen = edges.pruned(chosen, SHORTEST * _scales(edges, exact))
    return Creases(edges, noise, normals, exact, chosen, *settled)


def measured_again(found: Creases, chosen: Mask) -> Creases:
    """Return creases of other edges, with what is measured at them."""
    jumps, places, directions = _settled(found.edges, found.normals, found.noise, found.exact, chosen)
    return replace(found, chosen=chosen, jumps=jumps, places=places, directions=directions)


def _ordinary_jump(edges: Edges, normals: Array, noise: float, exact: Mask, bends: Array) -> float:
    """Return the median jump at edges whose triangles' normals are not exact, from a sample; 0 if few are such."""
    vague = np.flatnonzero(~exact[edges.sides].any(axis=1))
    if len(vague) < MANY * len(bends) or not len(vague):
        return 0.0
    some = np.zeros(len(bends), bool)
    some[vague[:: max(1, len(vague) // SAMPLE)]] = True
    jumps, _, _ = _jumps(edges, normals, noise, exact, some, bends)
    return float(np.median(np.abs(jumps[some])))


def bent(normals: Array, sides: Indices) -> Array:
    """Return the angles (e,) between the normals of the triangles at edges."""
    one, two = normals[sides].transpose(1, 0, 2)
    return np.arccos(np.clip(dot(one, two), -1.0, 1.0))


def _jumps(
    edges: Edges, normals: Array, noise: float, exact: Mask, chosen: Mask, strengths: Array
) -> tuple[Array, Array, Array]:
    """Return jumps (e,) of the normal, places and directions (e, 3), 0 where not chosen."""
    facets = edges.facets
    near, stops = _touching(edges, chosen) & ~exact, edges.halved(chosen & (strengths > STRONG))
    sides = _kernels_jumps.Sides(normals, near, exact, stops)
    at = np.flatnonzero(chosen)
    jumps, places, directions = np.zeros(len(chosen)), np.zeros((len(chosen), 3)), np.zeros((len(chosen), 3))
    filled = np.zeros(len(at)), np.zeros((len(at), 3)), np.zeros((len(at), 3))
    _kernels_jumps.fill_jumps(facets, sides, edges.halves[at], noise, *filled)
    jumps[at], places[at], directions[at] = filled
    return jumps, places, directions


def _settled(edges: Edges, normals: Array, noise: float, exact: Mask, chosen: Mask) -> tuple[Array, Array, Array]:
    """Return jumps (e,), places and directions (e, 3) at clean lines, which no window crosses any more."""
    facets, beside = edges.facets, np.unique(edges.sides[chosen])
    beside, normals = beside[~exact[beside]], normals.copy()
    normals[beside] = within_zones(facets, noise, edges.zones(chosen), beside)
    return _jumps(edges, normals, noise, exact, chosen, np.full(len(chosen), np.inf))


def _scales(edges: Edges, exact: Mask) -> Array:
    """Return the lengths (e,) that measure short lines and gaps: the mesh's edges there, 0 where all is exact."""
    scales: Array = edges.facets.scales[edges.sides].mean(axis=1)
    scales[exact[edges.sides].all(axis=1)] = 0.0
    return scales


def _touching(edges: Edges, chosen: Mask) -> Mask:
    """Return which triangles (t,) have a vertex on chosen edges."""
    touched = np.zeros(len(edges.facets.vertices), bool)
    touched[edges.ends[chosen]] = True
    out: Mask = np.asarray(touched[edges.facets.faces].any(axis=1))
    return out


def _cleaned(edges: Edges, chosen: Mask, jumps: Array, bends: Array, angle: float, exact: Mask) -> Mask:
    """Return edges as clean lines: gaps closed, duplicates and crumbs gone, each line a crease on the whole."""
    scale = _scales(edges, exact)
    costs = edges.lengths * np.maximum(0.1, 1 - bends / np.radians(20))
    most = np.zeros(len(edges.facets.vertices))
    np.maximum.at(most, edges.ends.ravel(), np.repeat(GAP * scale, 2))

    def strength(lines: Chains) -> Array:
        return lines.total(jumps * edges.lengths) / lines.total(edges.lengths) - angle

    for bridging in (True, True, False):
        chosen = edges.without_weakest(chosen, strength)
        chosen = edges.without_small(chosen, jumps, FEWEST, exact)
        chosen = edges.pruned(chosen, SHORTEST * scale)
        if bridging:
            chosen = edges.bridged(chosen, costs, most)
    return chosen
