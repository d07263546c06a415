"""How much the surface bends inside its zones."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, tangents
from simplexmesh.surface.features.lines._kernels_patches import patches
from simplexmesh.surface.features.lines.creases import Creases

NEAR = 0.02
"""Weight of triangles that touch a sharp edge: they may straddle it."""

NARROW, WIDE = 3.0, 10.0
"""Radius of the windows in edges of the mesh, and least in roots of noise times edge."""


def bending(found: Creases, labels: Indices) -> Array:
    """Return the norms (t,) of the curvature of normals fitted in windows within zones (Veron et al. 1998, 3)."""
    facets, n = found.edges.facets, len(labels)
    scale = float(facets.scales.mean())
    radii = np.maximum(NARROW * scale, WIDE * np.sqrt(facets.noise * scale))
    offsets, members = patches(facets.faces, len(facets.vertices), facets.centers, radii, np.arange(n))
    owner = np.repeat(np.arange(n), np.diff(offsets))
    inside = labels[members] == labels[owner]
    owner, members = owner[inside], members[inside]
    weights, apart = found.areas_beside(NEAR)[members], facets.centers[members] - facets.centers[owner]
    frame = tangents(found.normals)
    along = [dot(apart, axis[owner]) for axis in frame]
    turned = [dot(facets.normals[members], axis[owner]) for axis in frame]

    def mean(values: Array) -> Array:
        return np.bincount(owner, weights * values, n) / np.maximum(np.bincount(owner, weights, n), 1e-300)

    middles, normals = [mean(x) for x in along], [mean(x) for x in turned]
    A = np.empty((n, 2, 2))
    b = np.empty((n, 2, 2))
    for i in range(2):
        for j in range(2):
            A[:, i, j] = mean(along[i] * along[j]) - middles[i] * middles[j] + (i == j) * (0.1 * scale) ** 2
            b[:, i, j] = mean(along[i] * turned[j]) - middles[i] * normals[j]
    out: Array = np.sqrt((np.linalg.solve(A, b) ** 2).sum(axis=(1, 2)))
    return out
