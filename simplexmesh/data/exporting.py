"""Objects of trimesh and Open3D made of ours, with arrays of their own; the only module that imports these."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base.named_arrays import is_color

EXPORT = "the extra export: pip install 'simplexmesh[export]'"


def to_trimesh(value: Any) -> Any:
    """Return a `trimesh.Trimesh` of a triangle mesh or a `trimesh.PointCloud` of points, with colors and unit."""
    try:
        import trimesh
    except ImportError as error:
        raise ImportError(f"this needs {EXPORT}") from error
    value = _triangulated(value)
    colors = value.data.get("colors")
    shown = np.array(colors) if colors is not None and is_color(colors) else None
    if not hasattr(value, "faces"):
        out = trimesh.PointCloud(np.array(value.points), colors=shown)
    else:
        others = {name: np.array(values) for name, values in value.data.items() if name != "colors" or shown is None}
        positions = np.array(value.vertices), np.array(value.faces)
        out = trimesh.Trimesh(*positions, process=False, vertex_colors=shown, vertex_attributes=others)
        out.units = value.unit
    return out


def by_trimesh(surface: Any, kind: str) -> bytes:
    """Return the file that trimesh makes of a triangle mesh: "glb" or "3mf", which needs lxml and networkx."""
    made = to_trimesh(surface)
    try:
        return made.export(file_type=kind)
    except ImportError as error:
        raise ImportError(f"this needs {EXPORT}") from error


def to_open3d(value: Any) -> Any:
    """Return an `open3d.t.geometry` TriangleMesh or PointCloud, with normals, colors as shares, and other arrays."""
    try:
        import open3d
    except ImportError as error:
        raise ImportError("this needs Open3D: pip install open3d") from error
    value = _triangulated(value)
    if hasattr(value, "faces"):
        out = open3d.t.geometry.TriangleMesh()
        table, positions, normals = out.vertex, value.vertices, value.vertex_normals
        out.triangle["indices"] = open3d.core.Tensor(np.array(value.faces))
    else:
        out = open3d.t.geometry.PointCloud()
        table, positions, normals = out.point, value.points, value.normals
    named = {"positions": positions} | ({} if normals is None else {"normals": normals})
    for name, values in (value.data | named).items():
        rows = np.array(values)
        if name == "colors" and is_color(rows):
            rows = (rows[:, :3] / 255).astype(np.float32)
        table[name] = open3d.core.Tensor(rows.reshape(len(rows), -1))
    return out


def _triangulated(value: Any) -> Any:
    return value.triangulated() if hasattr(value, "triangulated") else value
