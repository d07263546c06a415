"""What is drawn of a surface or of points, with numbers or colors on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot import skin

Array = NDArray[np.float64]

SMOOTH = 60.0
"""Degrees; scans are drawn smooth, and with an edge only where triangles meet at more."""


def colored(shown: Any, name: str, values: Array) -> pv.PolyData:
    """Return what is drawn of a thing, with numbers or colors at its points."""
    if isinstance(shown, SimplexMesh):
        coat, _ = skin.geometry(shown, None, None)
        coat[name] = skin.per_point(shown, values)
        return coat
    if isinstance(shown, PointCloud):
        coat, _ = skin.geometry(PointCloud(shown.points[: skin.MOST_POINTS], _first(shown.normals)), None, None)
        coat[name] = np.repeat(values[: skin.MOST_POINTS], coat.n_points // min(len(values), skin.MOST_POINTS), axis=0)
        return coat
    coat = pv.PolyData.from_regular_faces(np.asarray(shown.vertices), np.asarray(shown.faces))
    coat[name] = values
    return coat.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=SMOOTH, consistent_normals=False,
        auto_orient_normals=False,
    )  # fmt: skip


def cells(shown: TriangleMesh, colors: Array) -> pv.PolyData:
    """Return a surface cut into what is nearest to each vertex, in its color: nothing blends where classes meet."""
    normals, faces = shown.vertex_normals, shown.faces
    a, b, c = faces, np.roll(faces, -1, axis=1), np.roll(faces, 1, axis=1)

    def corners(values: Array) -> Array:
        middle = values[faces].mean(axis=1, keepdims=True) + np.zeros((1, 3, 1))
        parts = values[a], 0.5 * (values[a] + values[b]), middle, 0.5 * (values[a] + values[c])
        return np.stack(parts, axis=2).reshape(-1, 3)

    points = corners(shown.vertices)
    coat = pv.PolyData.from_regular_faces(points, np.arange(len(points)).reshape(-1, 4))
    coat["classes"] = np.repeat(colors[faces].reshape(-1, 3), 4, axis=0)
    coat.point_data["Normals"] = corners(normals)
    coat.point_data.active_normals_name = "Normals"
    return coat


def _first(normals: Array | None) -> Array | None:
    return None if normals is None else normals[: skin.MOST_POINTS]
