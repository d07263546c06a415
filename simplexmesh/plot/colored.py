"""PyVista geometry of surfaces and points with per-vertex values or colors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.plot import drawable

Array = NDArray[np.float64]

SMOOTH = 60.0
"""Feature angle in degrees: scans are drawn smooth except where triangles meet at a larger one."""


def colored(shown: Any, name: str, values: Array) -> pv.PolyData:
    """Return the geometry of a surface or cloud with an array of values or colors at its points."""
    if isinstance(shown, SimplexMesh):
        polydata, _ = drawable.geometry(shown, None, None)
        polydata[name] = drawable.per_point(shown, values)
        return polydata
    if isinstance(shown, PointCloud):
        kept = drawable.kept_points(len(values))
        normals = None if shown.normals is None else shown.normals[kept]
        polydata, _ = drawable.geometry(PointCloud(shown.points[kept], normals), None, None)
        polydata[name] = np.repeat(values[kept], polydata.n_points // len(kept), axis=0)
        return polydata
    polydata = pv.PolyData.from_regular_faces(np.asarray(shown.vertices), np.asarray(shown.faces))
    polydata[name] = values
    return polydata.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=SMOOTH, consistent_normals=False,
        auto_orient_normals=False,
    )  # fmt: skip


def vertex_cells(shown: TriangleMesh, colors: Array) -> pv.PolyData:
    """Return a surface divided into barycentric cells of the vertices, so that colors of classes do not blend."""
    normals, faces = shown.vertex_normals, shown.faces
    a, b, c = faces, np.roll(faces, -1, axis=1), np.roll(faces, 1, axis=1)

    def corners(values: Array) -> Array:
        middle = values[faces].mean(axis=1, keepdims=True) + np.zeros((1, 3, 1))
        parts = values[a], 0.5 * (values[a] + values[b]), middle, 0.5 * (values[a] + values[c])
        return np.stack(parts, axis=2).reshape(-1, 3)

    points = corners(shown.vertices)
    polydata = pv.PolyData.from_regular_faces(points, np.arange(len(points)).reshape(-1, 4))
    polydata["classes"] = np.repeat(colors[faces].reshape(-1, 3), 4, axis=0)
    polydata.point_data["Normals"] = corners(normals)
    polydata.point_data.active_normals_name = "Normals"
    return polydata
