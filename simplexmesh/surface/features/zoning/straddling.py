"""Triangles that straddle sharp edges, given to the side on which they lie."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import cross, dot, norm
from simplexmesh.surface.features.lines.creases import Creases
from simplexmesh.surface.features.zoning import edits

ASKEW = 0.1
"""In squared edges of the mesh: edges on a crease go 0 across it, those of triangles that ignore it about 0.3."""


def sided(labels: Indices, found: Creases, vertices: Array) -> Indices:
    """Return labels (t,) with triangles at sharp edges in the zone on whose side of the crease their centers lie.

    Lines run along edges of the mesh, `vertices` (n, 3) are on the crease. Triangles of a mesh with edges on its crease
    stay where they are, zones connected, and one that would lose all its triangles keeps them.
    """
    edges, facets = found.edges, found.edges.facets
    lines = _askew(found)
    triangles, nearest = _nearest_lines(found, lines, vertices[edges.ends].mean(axis=1))
    to = facets.centers[triangles] - vertices[edges.ends[nearest]].mean(axis=1)
    mean = found.normals[edges.sides[nearest]].sum(axis=1)
    right = (dot(to, cross(found.directions[nearest], mean)) > 0).astype(int)
    beside, beyond = labels[edges.sides[nearest, right]], labels[edges.sides[nearest, 1 - right]]
    wanted = labels.copy()
    wanted[triangles] = np.where(labels[triangles] == beyond, beside, labels[triangles])
    while (lost := np.bincount(wanted, minlength=labels.max() + 1)[labels] == 0).any():
        wanted = np.where(lost, labels, wanted)  # which may take the last triangle of another zone
    return edits.connected(wanted, edges)


def _askew(found: Creases) -> Indices:
    """Return the edges of lines that on the whole run to and fro along their crease by more than noise explains."""
    edges, lines = found.edges, found.edges.chains(found.chosen)
    start, end = edges.facets.vertices[edges.ends].transpose(1, 0, 2)
    aside = (
        edges.lengths**2
        - dot(end - start, found.directions) ** 2
        - 4 * edges.facets.noise[edges.sides].mean(axis=1) ** 2
    )
    askew = lines.mean(aside / edges.facets.scales[edges.sides].mean(axis=1) ** 2) > ASKEW
    return lines.edges[np.repeat(askew, np.diff(lines.offsets))]


def _nearest_lines(found: Creases, lines: Indices, middles: Array) -> tuple[Indices, Indices]:
    """Return the triangles (k,) at edges of lines, and the nearest edge (k,) of those that share a vertex."""
    facets, ends = found.edges.facets, found.edges.ends[lines]
    shape = (len(facets.vertices), len(lines))
    at = csr_matrix((np.ones(ends.size, bool), (ends.ravel(), np.repeat(np.arange(len(lines)), 2))), shape)
    corners = csr_matrix((np.ones(facets.faces.size, bool), facets.faces.ravel(), 3 * np.arange(len(facets.faces) + 1)))
    corners.resize(len(facets.faces), len(facets.vertices))
    pairs = (corners @ at).tocoo()
    triangles, edges = pairs.row, lines[pairs.col]
    order = np.lexsort((norm(facets.centers[triangles] - middles[edges]), triangles))
    triangles, edges = triangles[order], edges[order]
    first = np.append(True, np.diff(triangles) > 0)[: len(triangles)]
    return triangles[first], edges[first]
