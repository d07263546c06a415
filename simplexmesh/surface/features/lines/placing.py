"""Vertices of lines placed where the surfaces on both sides meet."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.surface.features.lines.creases import Creases
from simplexmesh.surface.features.lines.edge_sets import Chains

HOLD = 0.05
"""Weight with which a vertex keeps its place along a line, where nothing else holds it."""

SMOOTHINGS = (0.5, -0.53) * 4
"""Shares of the way to the middle of two neighbors, there and back (Taubin 1995): curves keep their radius."""

BEYOND = slice(2, 6)
"""Of a line's edges, those that place the node at its end."""

FARTHEST = 2.0
"""In edges of the mesh: a vertex that would move farther stays."""


def placed(found: Creases) -> Array:
    """Return the vertices (n, 3), those at chosen edges moved nearest to the crease lines measured at their edges.

    Each edge gives a line, through its place in its direction. A vertex goes where the sum of the squared distances
    from those of its edges is least. Where lines meet, windows are small and see little; so nodes go where the lines
    of edges farther along meet, and the vertices next to them between. Vertices stay along lines on their creases.
    """
    edges, vertices, chosen = found.edges, found.edges.facets.vertices, found.chosen
    lines = edges.chains(chosen)
    known = found.off & (norm(found.directions) > 0)
    vague = np.zeros(len(vertices), bool)
    vague[edges.ends[known]] = True
    out = _met(found, vertices, edges.ends[known].ravel(), np.repeat(np.flatnonzero(known), 2))
    nodes, by, first = _near_nodes(lines, vague & (edges.degrees(chosen) > 2))
    out = _met(found, out, nodes[known[by]], by[known[by]])
    for node, one, two, on in first:
        out[[one, two]] = out[node] + (out[on] - out[node]) * [[1 / 3], [2 / 3]]
    return _smoothed(out, found, vague)


def _met(found: Creases, vertices: Array, at: Indices, by: Indices) -> Array:
    """Return vertices with those `at` (k,) moved to where the crease lines of the edges `by` (k,) meet best."""
    across = np.eye(3) - found.directions[by, :, None] * found.directions[by, None, :]
    towards = (across @ found.places[by, :, None])[:, :, 0]
    A, b = np.zeros((len(vertices), 3, 3)), np.zeros((len(vertices), 3))
    np.add.at(A, at, across)
    np.add.at(b, at, towards)
    on = np.unique(at)
    to = np.linalg.solve(A[on] + HOLD * np.eye(3), (b[on] + HOLD * vertices[on])[:, :, None])[:, :, 0]
    scale = np.full(len(vertices), np.inf)
    facets = found.edges.facets
    np.minimum.at(scale, facets.faces.ravel(), np.repeat(facets.scales, 3))
    longest = np.zeros(len(vertices))
    np.maximum.at(longest, found.edges.ends[by].ravel(), np.repeat(found.edges.lengths[by], 2))
    near = norm(to - facets.vertices[on]) <= FARTHEST * np.minimum(scale, np.where(longest > 0, longest, scale))[on]
    out = vertices.copy()
    out[on[near]] = to[near]
    return out


def _near_nodes(lines: Chains, nodes: Mask) -> tuple[Indices, Indices, list[tuple[int, int, int, int]]]:
    """Return nodes with edges a little along each of their lines, and the first four vertices of these lines."""
    at, by, first = [], [], []
    for k in np.flatnonzero(np.diff(lines.offsets) >= 2 * BEYOND.stop):
        edges, vertices = lines.of(int(k)), lines.along(int(k))
        for ordered, along in ((vertices, edges), (vertices[::-1], edges[::-1])):
            if nodes[ordered[0]]:
                at += [int(ordered[0])] * (BEYOND.stop - BEYOND.start)
                by += along[BEYOND].tolist()
                first.append(tuple(ordered[:4].tolist()))
    return np.array(at, np.int64), np.array(by, np.int64), first


def _smoothed(vertices: Array, found: Creases, vague: Mask) -> Array:
    """Return vertices with those inside lines smoothed along them."""
    edges = found.edges
    moved = np.flatnonzero((edges.degrees(found.chosen) == 2) & vague)
    ends = edges.ends[found.chosen]
    for step in SMOOTHINGS:
        total = np.zeros_like(vertices)
        np.add.at(total, ends[:, 0], vertices[ends[:, 1]])
        np.add.at(total, ends[:, 1], vertices[ends[:, 0]])
        vertices[moved] += step * (0.5 * total[moved] - vertices[moved])
    return vertices
