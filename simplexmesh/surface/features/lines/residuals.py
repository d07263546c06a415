"""By how much vertices are off the smooth surfaces through those around them."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.vectors import dot, normalized, tangents
from simplexmesh.surface.features.lines._kernels_patches import patches
from simplexmesh.surface.features.lines.facets import Facets

SAMPLE = 2000
"""Triangles whose surroundings are fitted: they tell the noise to about a hundredth."""

TERMS, LEAST = 6, 3
"""Coefficients of a quadric over a plane, and points that a patch must have beside them."""

HOLD = 1e-9
"""Keeps fits to points along a line from being singular."""

FEW, DEVIATION = 0.15, 0.666
"""A share that tells noise, and the root mean square below which so many are of six standard normal residuals."""


def residual_noise(facets: Facets) -> float:
    """Return the deviation of vertices from quadrics through the twelve or so around triangles; infinite if unknown.

    The seventh of the triangles with the least tells it: creases are no quadrics. However coarse the triangles of a
    smooth surface are and whichever way their edges bend, its vertices are near a quadric.
    """
    at = np.arange(0, len(facets.faces), max(1, len(facets.faces) // SAMPLE))
    offsets, members = patches(facets.faces, len(facets.vertices), facets.centers, np.zeros(len(at)), at)
    owner, n = np.repeat(np.arange(len(at)), np.diff(offsets)), len(facets.vertices)
    normals = normalized(np.add.reduceat(facets.areas[members, None] * facets.normals[members], offsets[:-1]))
    owner, vertices = np.divmod(np.unique(owner[:, None] * n + facets.faces[members]), n)
    squares = _residuals(facets.vertices[vertices] - facets.centers[at][owner], owner, normals)
    free = np.bincount(owner) - TERMS
    told = squares[free >= LEAST] / free[free >= LEAST]
    return float(np.sqrt(np.quantile(told, FEW))) / DEVIATION if len(told) else np.inf


def _residuals(points: Array, owner: Indices, normals: Array) -> Array:
    """Return the sums (k,) of squared distances along normals (k, 3) of points (n, 3), by owner, from quadrics."""
    u, v = (dot(points, axis[owner]) for axis in tangents(normals))
    starts = np.searchsorted(owner, np.arange(len(normals)))
    reach = np.maximum(np.sqrt(np.maximum.reduceat(u**2 + v**2, starts)), 1e-300)[owner]
    u, v, heights = u / reach, v / reach, dot(points, normals[owner])
    basis = np.stack([np.ones(len(u)), u, v, u * u, u * v, v * v], axis=1)
    left = np.add.reduceat(basis[:, :, None] * basis[:, None, :], starts) + HOLD * np.eye(TERMS)
    right = np.add.reduceat(basis * heights[:, None], starts)
    fitted = np.linalg.solve(left, right[:, :, None])[:, :, 0].astype(float)
    return np.bincount(owner, (heights - dot(basis, fitted[owner])) ** 2).astype(float)
