"""Curvatures of triangles around a vertex, and what is left of them whatever the lengths of the edges."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import dot, norm
from simplexmesh.surface.features.lines.edge_sets import Edges


def shape_invariant(edges: Edges, bends: Array) -> Array:
    """Return I_Kabs (n,), the sum of squared principal curvatures where each triangle is a sector of radius 1.

    Angles `bends` (e,) across the edges give the mean curvature, angles of the triangles that of Gauss (Veron, Lesage
    and Leon 1998, section 3). On a straight crease of angle b in planes it is 9 b^2 / pi^2; below 0 it counts as 0.
    """
    vertices, faces = edges.facets.vertices, edges.facets.faces
    n, corners = len(vertices), vertices[faces]
    out, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    lengths = np.maximum(norm(out) * norm(back), 1e-300)
    angles = np.arccos(np.clip(dot(out, back) / lengths, -1.0, 1.0)).ravel()
    at = faces.ravel()
    total = np.bincount(at, angles, n)
    chord = 2 * np.sin(angles / 2)
    cell = np.bincount(at, np.maximum(angles / 4 - chord**2 / np.maximum(np.tan(angles), 1e-9) / 8, angles / 8), n)
    turned = np.bincount(edges.ends.ravel(), np.repeat(bends, 2), n)
    mean = turned / 4 / np.maximum(total / 6, 1e-300)
    gauss = (2 * np.pi - total) / np.maximum(cell, 1e-300)
    return np.maximum(4 * mean**2 - 2 * gauss, 0.0)


def straight(angle: float) -> float:
    """Return I_Kabs of a vertex on a straight crease of an angle, between planes."""
    return 9 * angle**2 / np.pi**2
