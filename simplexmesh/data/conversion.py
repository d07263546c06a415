"""Convert arguments to this library's data types, from arrays, objects of other libraries, and paths."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh.data.foreign import converted
from simplexmesh.data.points import PointCloud, cloud_of_rows, cloud_of_vertices
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.data.volume import Volume


def as_data(value: Any, name: str = "data") -> Any:
    """Return a Volume, PointCloud, TriangleMesh or SimplexMesh from any of them, a path, arrays, or other objects.

    Duplicates among points are merged.
    """
    found = as_given(value, name)
    return found.merged() if isinstance(found, PointCloud) else found


def as_given(value: Any, name: str = "data") -> Any:
    """Return the same with all points as they were given, duplicates too."""
    if isinstance(value, Volume | PointCloud | TriangleMesh) or _is_simplex_mesh(value):
        return value
    if isinstance(value, str | os.PathLike):
        from simplexmesh.data.io.reading import read

        return read(value)
    found = converted(value, name)
    if found is not None:
        return found.welded() if isinstance(found, TriangleMesh) else found
    if _is_pair(value, name):
        return TriangleMesh(*value)
    if isinstance(value, np.ndarray | list | tuple) or hasattr(value, "__array__"):
        return _from_array(value, name)
    raise TypeError(
        f"{name} must be a Volume, PointCloud, TriangleMesh, SimplexMesh, array, object of PyVista, trimesh, Open3D, "
        f"SimpleITK, nibabel, meshio or pandas, or path, not {checks.type_name(value)}"
    )


def as_volume(value: Any) -> Volume:
    """Return a Volume from any supported input; see `as_data`."""
    out = as_data(value, "volume")
    if not isinstance(out, Volume):
        raise TypeError(f"volume must be a volume, not {_description(value, out)}")
    return out


def as_points(value: Any, name: str = "points") -> PointCloud:
    """Return a PointCloud from any supported input, duplicates merged; a surface gives its vertices and normals."""
    return given_points(value, name).merged()


def given_points(value: Any, name: str = "points") -> PointCloud:
    """Return the same with all points as they were given, duplicates too."""
    out = as_given(value, name)
    if isinstance(out, PointCloud):
        return out
    if isinstance(out, TriangleMesh) or _is_simplex_mesh(out):
        return cloud_of_vertices(out)
    raise TypeError(f"{name} must be points, not {_description(value, out)}")


def as_triangles(value: Any, name: str = "triangles") -> TriangleMesh:
    """Return a TriangleMesh from any supported input, also `(vertices, faces)`; a simplex mesh is triangulated."""
    pair = isinstance(value, tuple | list) and len(value) == 2
    if pair and all(checks.any_array(name, part).ndim == 2 for part in value):
        return TriangleMesh(value[0], value[1])
    out = as_data(value, name)
    if isinstance(out, TriangleMesh):
        return out
    if _is_simplex_mesh(out):
        return out.triangulated()
    raise TypeError(f"{name} must be a surface of triangles, not {_description(value, out)}")


def _from_array(value: Any, name: str) -> Volume | PointCloud:
    array = checks.any_array(name, value)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name} must be numbers, not {type(value).__name__} of {array.dtype}")
    if array.ndim == 3:
        return Volume(array)
    if array.ndim == 2 and array.shape[1] in (3, 6):
        return cloud_of_rows(name, array)
    raise ValueError(
        f"{name} must have shape (*, 3) for points, (*, 6) with normals or colors, or (nx, ny, nz) for a volume, "
        f"not {array.shape}"
    )


def _is_pair(value: Any, name: str) -> bool:
    """Whether the value is (vertices, faces): a tuple of two tables or a list of two arrays, the second of integers."""
    if not (isinstance(value, tuple | list) and len(value) == 2):
        return False
    if isinstance(value, list) and not all(isinstance(part, np.ndarray) for part in value):
        return False
    vertices, faces = (checks.any_array(name, part) for part in value)
    if not (vertices.ndim == faces.ndim == 2 and faces.dtype.kind in "iu" and faces.shape[1] == 3):
        if vertices.ndim == faces.ndim == 2 and (isinstance(value, tuple) or vertices.shape[1] == faces.shape[1] == 3):
            wanted = "(vertices, faces), the latter (f, 3) whole numbers, or a PointCloud of points and normals"
            found = " and ".join(f"{part.shape} {part.dtype}" for part in (vertices, faces))
            raise ValueError(f"{name} must be {wanted}, not a pair of {found}")
        return False
    return isinstance(value, tuple) or vertices.dtype.kind == "f"  # a list of two integer arrays is ambiguous


def _is_simplex_mesh(value: Any) -> bool:
    return hasattr(value, "connectivity") and hasattr(value, "triangulated")


def _description(value: Any, out: Any) -> str:
    """Return what was given and what it was read as, for messages."""
    if isinstance(value, str | os.PathLike):
        kind, *advice = checks.type_name(out).split(",")
        return ",".join([f"the {kind} in {os.path.basename(os.fspath(value))}", *advice])
    if type(value) is type(out):
        return f"a {checks.type_name(out)}"
    return f"{checks.type_name(value)} read as {checks.type_name(out)}"
