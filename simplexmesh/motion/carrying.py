"""Named arrays and the unit of data, carried to a mesh that was fitted to it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.vectors import cross, dot
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.targets.triangles import Triangles
from simplexmesh.numerics.blending import blended

Array = NDArray[np.float64]
Rows = tuple[NDArray[np.int64], Array]

NEAREST = 4
"""Points whose values are averaged, by the inverse of their squared distances."""


def with_data_of(mesh: SimplexMesh, source: Any) -> SimplexMesh:
    """Return a mesh with the unit and the arrays of points, triangles or a volume that it was fitted to.

    Values come from the nearest points, or from the nearest place on the triangles; the mesh keeps its own arrays.
    """
    data = getattr(source, "data", {})
    if not data:
        return replace(mesh, unit=source.unit)
    rows, weights = (_corners if isinstance(source, TriangleMesh) else _neighbors)(source, mesh.vertices)
    return replace(mesh, data={**blended(data, rows, weights), **mesh.data}, unit=source.unit)


def _neighbors(cloud: Any, places: Array) -> Rows:
    distance, rows = cKDTree(cloud.points).query(places, k=min(NEAREST, len(cloud)), workers=-1)
    nearest = np.maximum(distance[:, :1], np.finfo(np.float64).tiny)
    return rows, np.where(distance > 0, nearest / np.maximum(distance, nearest), 1.0) ** 2


def _corners(surface: TriangleMesh, places: Array) -> Rows:
    """Return the corners of the nearest triangles and the shares of their areas opposite the nearest points."""
    _, closest, faces = Triangles(surface).closest(places)
    rows = surface.faces[faces]
    ends = surface.vertices[rows] - closest[:, None]
    whole = surface.face_vectors[faces]
    shares = [dot(cross(ends[:, (j + 1) % 3], ends[:, (j + 2) % 3]), whole) for j in range(3)]
    weights = np.clip(np.stack(shares, axis=1), 0.0, None)
    known = weights.sum(axis=1, keepdims=True) > 0  # not for a triangle without area
    return rows, np.where(known, weights, 1.0)
