"""Triangles that straddle sharp edges, given to the side on which they lie."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from simplexmesh._base.vectors import cross, dot, norm
from simplexmesh.surface.features.lines.creases import Creases
from simplexmesh.surface.features.zoning import edits

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def sided(labels: Indices, found: Creases, vertices: Array) -> Indices:
    """Return labels (t,) with triangles at sharp edges in the zone on whose side of the crease their centers lie.

    Lines run along edges of the mesh, and where `vertices` (n, 3), placed on the crease, are not those of the mesh its
    triangles lie to both sides of what they border. Zones stay connected.
    """
    edges, facets = found.edges, found.edges.facets
    moved = (vertices != facets.vertices).any(axis=1)
    lines = np.flatnonzero(found.chosen & moved[edges.ends].any(axis=1))
    triangles, nearest = _nearest_lines(found, lines, vertices[edges.ends].mean(axis=1))
    to = facets.centers[triangles] - vertices[edges.ends[nearest]].mean(axis=1)
    mean = found.normals[edges.sides[nearest]].sum(axis=1)
    right = (dot(to, cross(found.directions[nearest], mean)) > 0).astype(int)
    beside, beyond = labels[edges.sides[nearest, right]], labels[edges.sides[nearest, 1 - right]]
    wanted = labels.copy()
    wanted[triangles] = np.where(labels[triangles] == beyond, beside, labels[triangles])
    return edits.connected(wanted, edges)


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
