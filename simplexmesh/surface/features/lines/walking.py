"""Lines prolonged and joined along a surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices, Mask
from simplexmesh.surface.features.lines.creases import Creases
from simplexmesh.surface.features.lines.invariants import shape_invariant, straight

LOOKED_AT = 3
"""Edges at a vertex, those that bend most, along which a line may go on."""


def crease_angle(angle: Any) -> float:
    """Return an angle between 0 and pi, neither included, in radians."""
    out = checks.number("angle", angle)
    if not 0.0 < out < math.pi:
        raise ValueError(f"angle must lie between 0 and pi radians, not {out:g}: numpy.radians converts degrees")
    return out


def free_ends(found: Creases, chosen: Mask, line: Indices) -> list[int]:
    """Return the vertices at which the edges of a line end freely."""
    free = found.edges.free(chosen)
    return [int(v) for v in np.unique(found.edges.ends[line]) if free[v]]


def prolonged(found: Creases, chosen: Mask, line: Indices, angle: float) -> Mask:
    """Return edges with those added that go on from the free ends of a line, until they meet another one."""
    edges, chosen = found.edges, chosen.copy()
    bends = found.bends
    invariant = shape_invariant(edges, bends)
    ends = free_ends(found, chosen, line)
    if not ends:
        raise ValueError("a line to prolong must have a free end: this one is closed, or ends at others or the border")
    for end in ends:
        vertex, seen = end, set(np.unique(edges.ends[line]).tolist()) - set(ends)
        while True:
            open_edges = [e for e in edges.at(vertex) if not chosen[e]]
            most = sorted(open_edges, key=lambda e: -bends[e])[:LOOKED_AT]
            on = [e for e in most if bends[e] > angle and edges.other(e, vertex) not in seen]
            if not on:
                break
            best = max(on, key=lambda e: invariant[edges.other(e, vertex)])
            far = edges.other(best, vertex)
            if invariant[far] <= straight(angle):
                break
            arrived = bool(edges.degrees(chosen)[far])
            chosen[best], vertex = True, far
            seen.add(far)
            if arrived:
                break
    return chosen


def joined(found: Creases, chosen: Mask, one: Indices, two: Indices) -> Mask:
    """Return edges with the cheapest path between free ends of two lines, or of one; bent edges count a tenth."""
    edges = found.edges
    starts, goals = free_ends(found, chosen, one), free_ends(found, chosen, two)
    if np.array_equal(one, two):
        starts, goals = starts[:1], goals[1:]
    if not starts or not goals:
        raise ValueError("lines to join must have free ends")
    costs = edges.lengths * (1 - 0.9 * np.minimum(1.0, found.bends / np.radians(20)))
    paths = [edges.path(start, goals, ~chosen, costs) for start in starts]
    known = [path for path in paths if path]
    if not known:
        raise ValueError("lines to join must be connected along the surface")
    out = chosen.copy()
    out[min(known, key=lambda path: float(costs[path].sum()))] = True
    return out
