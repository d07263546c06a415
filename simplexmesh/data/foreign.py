"""Objects of other libraries as ours, told by the library that their class comes from: none needs to be installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.units import known_unit
from simplexmesh.data.columns import as_colors, data_of, normals_of, points_of
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume
from simplexmesh.data.welding import is_single_valued


def converted(value: Any, name: str) -> Any:
    """Return an object of a known library as ours, with all its points and arrays; None if it is none of these."""
    if _is_of_vtk(value):
        from simplexmesh.data.io import vtk

        return vtk.from_dataset(value, name)
    return next((make(value, name) for make in _makers(value)), None)


def is_foreign(value: Any) -> bool:
    """Whether an object is of a library that `converted` knows."""
    return _is_of_vtk(value) or any(_makers(value))


def _is_of_vtk(value: Any) -> bool:
    return hasattr(value, "IsA") and hasattr(value, "GetPointData")


def _makers(value: Any) -> Iterator[Callable[[Any, str], Any]]:
    libraries = (base.__module__.partition(".")[0] for base in type(value).__mro__)
    return (_LIBRARIES[each] for each in libraries if each in _LIBRARIES)


def _of_trimesh(value: Any, name: str) -> TriangleMesh | PointCloud | None:
    if hasattr(value, "geometry") and hasattr(value, "graph"):
        if not value.geometry:
            raise ValueError(f"{name} must hold a surface or points, the scene is empty")
        unit, value = value.units, value.to_geometry()
        value.units = unit
    if not hasattr(value, "vertices") or hasattr(value, "entities"):
        return None
    unit = known_unit(getattr(value, "units", None))
    faces = getattr(value, "faces", None)
    if faces is None or not len(faces):
        colors = getattr(value, "colors", ())
        return PointCloud(np.array(value.vertices), data={"colors": _seen(colors)} if len(colors) else {}, unit=unit)
    data = _per_row(dict(value.vertex_attributes), len(value.vertices))
    visual = value.visual
    if visual.kind == "texture":
        if visual.uv is not None and is_single_valued(np.array(value.vertices), np.array(visual.uv)):
            data["uv"] = np.array(visual.uv)
        visual = visual.to_color()
    if visual.kind is not None:
        data["colors"] = _seen(visual.vertex_colors)
    return TriangleMesh(np.array(value.vertices), np.array(faces), data, unit)


def _seen(colors: Any) -> NDArray[np.uint8]:
    """Return the colors of trimesh, without opacity if all are opaque."""
    rows = np.array(colors)
    return rows[:, :3].copy() if (rows[:, 3] == 255).all() else rows


def _of_open3d(value: Any, name: str) -> TriangleMesh | PointCloud | None:
    if any(hasattr(value, word) for word in ("line", "lines", "tetra", "tetras")):
        return None
    tensors = getattr(value, "point", getattr(value, "vertex", None))
    if tensors is not None:
        table = {key: tensors[key].cpu().numpy() for key, _ in tensors.items()}
        faces = value.triangle["indices"].cpu().numpy() if hasattr(value, "triangle") else ()
        points = table.pop("positions", np.zeros((0, 3)))
    elif hasattr(value, "triangles"):
        points, faces = value.vertices, np.array(value.triangles)
        table = {"colors": np.array(value.vertex_colors)}
    elif hasattr(value, "points"):
        points, faces = value.points, ()
        table = {"colors": np.array(value.colors), "normals": np.array(value.normals)}
    else:
        return None
    points = np.array(points, dtype=np.float64)
    data = _per_row(table, len(points))
    normals = data.pop("normals", None)
    if "colors" in data:
        data["colors"] = as_colors(data["colors"])
    data = {key: rows[:, 0] if rows.ndim == 2 and rows.shape[1] == 1 else rows for key, rows in data.items()}
    if len(faces):
        return TriangleMesh(points, np.array(faces), data)
    return PointCloud(points, normals, data)


def _of_simpleitk(value: Any, name: str) -> Volume | None:
    from simplexmesh.data.io import itk

    return itk.volume_of_image(value, name) if hasattr(value, "GetSpacing") else None


def _of_nibabel(value: Any, name: str) -> Volume | TriangleMesh | None:
    """Return an image as a volume in LPS, as files of this format are read, in millimeters if its unit is known."""
    if hasattr(value, "darrays"):
        return _of_gifti(value, name)
    if not hasattr(value, "affine") or not hasattr(value, "dataobj"):
        return None
    samples = np.asanyarray(value.dataobj)
    while samples.ndim > 3 and samples.shape[-1] == 1:
        samples = samples[..., 0]
    T = np.diag([-1.0, -1, 1, 1]) @ value.affine
    spacing = np.linalg.norm(T[:3, :3], axis=0)
    unit = known_unit(value.header.get_xyzt_units()[0]) if hasattr(value.header, "get_xyzt_units") else "mm"
    volume = Volume(samples, spacing, T[:3, 3], T[:3, :3] / spacing, unit)
    return volume if unit is None else volume.in_unit("mm")


def _of_gifti(value: Any, name: str) -> TriangleMesh:
    """Return a surface in LPS, as images are, with the arrays of its vertices by their names."""
    points, faces = map(value.get_arrays_from_intent, ("NIFTI_INTENT_POINTSET", "NIFTI_INTENT_TRIANGLE"))
    if not points or not faces:
        raise ValueError(f"{name} must hold points and triangles, it does not")
    vertices = np.asarray(points[0].data, dtype=np.float64) * (-1, -1, 1)
    others = [each for each in value.darrays if each is not points[0] and each is not faces[0]]
    named = {each.meta.get("Name", f"array_{k}"): each.data for k, each in enumerate(others)}
    return TriangleMesh(vertices, np.array(faces[0].data), _per_row(named, len(vertices)), "mm")


def _of_meshio(value: Any, name: str) -> TriangleMesh | PointCloud | None:
    if not hasattr(value, "points") or not hasattr(value, "cells"):
        return None
    from simplexmesh.data.io.polygons import triangulated

    blocks = [block for block in value.cells if block.type not in ("vertex", "line")]
    solid = [block.type for block in blocks if not block.type.startswith(("triangle", "quad", "polygon"))]
    if solid or any(block.type[-1].isdigit() and not block.type.startswith("polygon") for block in blocks):
        found = ", ".join(sorted({block.type for block in blocks}))
        raise TypeError(f"{name} must be a surface of triangles or polygons, not cells of {found}")
    points = np.array(value.points, dtype=np.float64)
    data = _per_row(value.point_data, len(points))
    normals = data.pop("Normals", data.pop("normals", None))
    if not blocks:
        return PointCloud(points, normals, data)
    rows = [np.asarray(row) for block in blocks for row in block.data]
    corners, sizes = np.concatenate(rows), np.array([len(row) for row in rows])
    return TriangleMesh(points, triangulated(points, sizes, corners), data)


def _of_frame(value: Any, name: str) -> PointCloud | None:
    if not hasattr(value, "columns"):
        return None
    table = {str(key): value[key].to_numpy() for key in value.columns}
    table = {key.lower() if key in ("X", "Y", "Z") else key: column for key, column in table.items()}
    if not {"x", "y", "z"} <= table.keys():
        if len(table) == 3 and all(column.dtype.kind in "biuf" for column in table.values()):
            return PointCloud(np.stack(list(table.values()), axis=1))
        raise ValueError(f"{name} must have columns x, y and z, or three of numbers, not {', '.join(table) or 'none'}")
    try:
        points, normals = points_of(table), normals_of(table)
    except (ValueError, TypeError):
        raise ValueError(f"{name} must have numbers in its columns x, y and z, and in nx, ny and nz") from None
    return PointCloud(points, normals, data_of(table))


def _per_row(table: Any, n: int) -> dict[str, NDArray[Any]]:
    """Return copies of the arrays of numbers that have a row for each point."""
    arrays = {str(key): checks.any_array(str(key), values) for key, values in table.items()}
    return {key: np.array(v) for key, v in arrays.items() if v.dtype.kind in "biuf" and v.ndim and len(v) == n}


_LIBRARIES = {
    "trimesh": _of_trimesh,
    "open3d": _of_open3d,
    "SimpleITK": _of_simpleitk,
    "nibabel": _of_nibabel,
    "meshio": _of_meshio,
    "pandas": _of_frame,
    "polars": _of_frame,
}
