"""How open data is: the share of a closed mesh near it that has no data of its own."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.start.report import FAR
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.numerics.kd_tree import uneven_tree

ENOUGH = 5000
"""Points that tell whether two sides share them, and vertices that are asked; more change nothing."""

NEIGHBORS = 100
"""Points that tell it of a place; fewer mislead at more places of plates that are thicker than their noise."""


def share_bare(mesh: SimplexMesh, points: Array) -> float:
    """Return the share of the area of a mesh that is far from all points; parts that face opposite ways count twice."""
    areas = _vertex_areas(mesh)
    away = uneven_tree(points).query(mesh.vertices, workers=-1)[0]
    lids = np.where(away > FAR * norm(np.ptp(points, axis=0)), areas, 0.0)
    return float((2 * lids.sum() - norm(lids @ mesh.normals)) / areas.sum())


def share_doubled(mesh: SimplexMesh, points: Array) -> float:
    """Return the share of the area of a closed mesh where two sides have only the points of one sheet.

    These are most frequent halfway between the sides, those of a solid near the sides: of normal noise wherever it is
    thicker than twice its standard deviation. Both are compared by how far points are from halfway: up to half, and
    from there to one and a half, of their root mean square around each vertex.
    """
    some, at = points[:: max(1, len(points) // ENOUGH)], slice(None, None, max(1, mesh.n_vertices // ENOUGH))
    off = np.abs(Triangles(mesh.triangulated(method="dual")).depths(some) - 0.5)
    off[~(off < 1.5)] = np.inf  # of another place
    around = off[uneven_tree(some).query(mesh.vertices[at], k=min(NEIGHBORS, len(some)), workers=-1)[1]]
    known = np.isfinite(around)
    squares = np.where(known, around, 0.0) ** 2
    scale = np.sqrt(squares.sum(axis=1) / np.maximum(known.sum(axis=1), 1))[:, None]
    halfway = (around < 0.5 * scale).sum(axis=1)
    at_sides = (around < 1.5 * scale).sum(axis=1) - halfway
    areas = _vertex_areas(mesh)[at]
    return float(areas[2 * halfway > at_sides].sum() / areas.sum())


def _vertex_areas(mesh: SimplexMesh) -> Array:
    c = mesh.connectivity
    return np.asarray((mesh.face_areas / c.face_sizes)[c.face].sum(axis=1))
