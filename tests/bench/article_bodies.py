"""Bodies that the article of 2012 has: an icosphere, and a capped cylinder and a cone of ten sectors and bands."""

from __future__ import annotations

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.vectors import normalized
from simplexmesh.bench.truth import closed
from simplexmesh.bench.truth.discretized import Discretized
from simplexmesh.bench.truth.grids import fan, tube
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.lattices import polyhedron, subdivided

SECTORS = BANDS = 10
SIZE = 100.0
"""Radius and height."""


def icosphere(frequency: int = 16, radius: float = 100.0) -> Discretized:
    """Return a projected icosahedron, edges divided by `frequency`: 10 frequency^2 + 2 vertices, 12 of valence 5."""
    points, faces = subdivided(*polyhedron("icosahedron"), frequency)
    x, y, z = normalized(points).T
    points, exact = closed.sphere(np.arctan2(y, x), np.arcsin(np.clip(z, -1, 1)), radius)
    return Discretized(points, faces, exact)


def capped_cylinder() -> TriangleMesh:
    """Return a cylinder with two caps, each a fan."""
    return _body(np.ones(BANDS + 1))


def cone() -> TriangleMesh:
    """Return a cone with its base, a fan."""
    return _body(1 - np.arange(BANDS) / BANDS)


def _body(widths: Array) -> TriangleMesh:
    """Return parallels of these widths, and fans from the first and the last to tips on the axis."""
    angle = 2 * np.pi * np.arange(SECTORS) / SECTORS
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = [
        np.column_stack([SIZE * share * circle, np.full(SECTORS, SIZE * j / BANDS)]) for j, share in enumerate(widths)
    ]
    n, first = SECTORS * len(widths), np.arange(SECTORS)
    caps = fan(first[::-1], n), fan(np.arange(n - SECTORS, n), n + 1)
    vertices = np.concatenate([*rings, [[0, 0, 0], [0, 0, SIZE]]])
    return TriangleMesh(vertices, np.concatenate([tube(SECTORS, len(widths) - 1), *caps]))
