"""Write meshes and point clouds to VTP, PLY, OBJ, OFF, STL and XYZ files, volumes to VTI and medical formats."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.drafts import draft
from simplexmesh._base.errors import warn
from simplexmesh.data.io import polydata

Array = NDArray[np.float64]

NOTABLE_ROUNDING = 1e-4
"""Rounding by more than this fraction of the extent gives a warning."""


@dataclass(frozen=True, eq=False)
class _Polygons:
    """The content of a file: points, polygons (possibly none), normals and point data."""

    points: Array
    sizes: NDArray[Any]
    corners: NDArray[Any]
    normals: Array | None = None
    data: dict[str, NDArray[Any]] = field(default_factory=dict)
    topology: Any = None
    triangles: Any = None


def save(path: str | os.PathLike[str], value: Any, *, arrays: Mapping[str, NDArray[Any]] | None = None) -> None:
    """Write a simplex mesh, triangle mesh, point cloud or volume in the format its file name says.

    `arrays` are additional point data by name, (n,) or (n, k), VTP only; a simplex mesh has its own.
    """
    where = checks.path("path", path)
    if hasattr(value, "spacing"):
        _save_volume(where, value)
        return
    suffix = where.suffix.lower()
    if suffix not in _WRITERS:
        raise ValueError(f"path must end with one of {', '.join(_WRITERS)}, not {suffix or 'nothing'} ({where.name})")
    content = _with_arrays(_content(value), {} if arrays is None else arrays, suffix)
    if suffix in (".obj", ".off", ".stl") and not len(content.sizes):
        raise ValueError(f"path must end with .vtp, .ply or .xyz for points without faces, not {suffix}")
    with draft(where) as part:
        _WRITERS[suffix](part, content)


def _save_volume(path: Path, volume: Any) -> None:
    """Write a volume as VTI by VTK, or in a medical format by ITK."""
    endings = (".mha", ".nrrd", ".nii", ".nii.gz", ".vti")
    if not path.name.lower().endswith(endings):
        raise ValueError(f"path must end with one of {', '.join(endings)} for a volume, not {path.name}")
    with draft(path) as part:
        if path.suffix.lower() == ".vti":
            to_pyvista(volume).save(part)
            return
        import SimpleITK

        image = SimpleITK.GetImageFromArray(volume.values.T)
        image.SetSpacing(volume.spacing.tolist())
        image.SetOrigin(volume.origin.tolist())
        image.SetDirection(volume.direction.ravel().tolist())
        try:
            SimpleITK.WriteImage(image, str(part), useCompression=True)
        except RuntimeError as error:
            raise OSError(f"{path.name} cannot be written: {str(error).splitlines()[-1]}") from None


def _with_arrays(content: _Polygons, arrays: Mapping[str, NDArray[Any]], suffix: str) -> _Polygons:
    checks.instance("arrays", arrays, Mapping)  # type: ignore[type-abstract]
    if arrays and (suffix != ".vtp" or content.topology is not None):
        where = "the arrays of a simplex mesh are its own" if content.topology is not None else f"{suffix} holds none"
        raise ValueError(f"arrays must be left out: {where}")
    data = dict(content.data)
    for name, values in arrays.items():
        if not isinstance(name, str):
            raise TypeError(f"arrays must be named by strings, not {type(name).__name__} {name!r}")
        data[name] = checks.any_array(f"arrays[{name!r}]", values)
        if data[name].dtype.kind not in "biuf":
            raise TypeError(f"arrays[{name!r}] must be numbers, not {type(values).__name__} of {data[name].dtype}")
        if data[name].ndim not in (1, 2) or len(data[name]) != len(content.points):
            raise ValueError(f"arrays[{name!r}] must have {len(content.points):,} rows, not shape {data[name].shape}")
    return replace(content, data=data)


def to_pyvista(value: Any) -> Any:
    """Return a `pyvista.ImageData` of a volume, a `PolyData` of a mesh (a simplex mesh without its holes) or cloud."""
    import pyvista

    if not hasattr(value, "spacing"):
        return pyvista.PolyData(_dataset(_content(value)), deep=False)
    out = pyvista.ImageData(dimensions=value.shape, spacing=value.spacing, origin=value.origin)
    out.direction_matrix = value.direction
    out.point_data["values"] = value.values.flatten(order="F")
    return out


def _content(value: Any) -> _Polygons:
    if hasattr(value, "connectivity"):
        topology = value.connectivity
        surface = ~topology.face_is_hole
        corners = topology.face_vertices[np.repeat(surface, topology.face_sizes)]
        sizes = topology.face_sizes[surface]
        return _Polygons(value.vertices, sizes, corners, None, dict(value.data), topology, value.triangulated)
    if hasattr(value, "vertices") and hasattr(value, "faces"):
        faces = np.asarray(value.faces)
        return _Polygons(value.vertices, np.full(len(faces), 3), faces.reshape(-1), triangles=lambda: value)
    if hasattr(value, "points") and hasattr(value, "normals"):
        none = np.zeros(0, dtype=np.int64)
        return _Polygons(value.points, none, none, value.normals)
    raise TypeError(f"value must be a SimplexMesh, TriangleMesh or PointCloud, not {type(value).__name__}")


def _dataset(content: _Polygons) -> Any:
    data = dict(content.data)
    if content.normals is not None:
        data["Normals"] = content.normals
    return polydata.polydata(content.points, content.sizes, content.corners, data, content.topology)


def _write_vtp(path: Path, content: _Polygons) -> None:
    for name, values in content.data.items():
        if not name or any(ord(letter) < 32 and letter not in "\t\n\r" for letter in name):
            raise ValueError(f"arrays must have printable names to be saved as VTP, not {name!r}")
        if not values[0].size:
            raise ValueError(f"array {name!r} must have columns to be saved as VTP, not shape {values.shape}")
    polydata.write_vtp(path, _dataset(content))


def _write_ply(path: Path, content: _Polygons) -> None:
    columns, names = content.points, ["x", "y", "z"]
    if content.normals is not None:
        columns, names = np.hstack([columns, content.normals]), [*names, "nx", "ny", "nz"]
    count = "uchar" if not len(content.sizes) or content.sizes.max() < 256 else "int"
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(columns)}"]
    header += [f"property double {name}" for name in names]
    if len(content.sizes):
        header += [f"element face {len(content.sizes)}", f"property list {count} int vertex_indices"]
    with path.open("wb") as file:
        file.write(("\n".join([*header, "end_header"]) + "\n").encode("ascii"))
        file.write(columns.astype("<f8").tobytes())
        file.write(_packed_lists(content.sizes, content.corners, "u1" if count == "uchar" else "<i4"))


def _packed_lists(sizes: NDArray[Any], corners: NDArray[Any], count: str) -> bytes:
    """Return the bytes of lists of int32, each preceded by its size."""
    head = np.dtype(count).itemsize
    lengths = head + 4 * sizes.astype(np.int64)
    starts = np.cumsum(lengths) - lengths
    out = np.zeros(int(lengths.sum()), np.uint8)
    out[starts[:, None] + np.arange(head)] = sizes.astype(count).view(np.uint8).reshape(-1, head)
    before = np.repeat(np.cumsum(sizes) - sizes, sizes)
    at = np.repeat(starts + head, sizes) + 4 * (np.arange(len(corners)) - before)
    out[at[:, None] + np.arange(4)] = corners.astype("<i4").view(np.uint8).reshape(-1, 4)
    return out.tobytes()


def _write_obj(path: Path, content: _Polygons) -> None:
    vertices = (f"v {x!r} {y!r} {z!r}\n" for x, y, z in content.points.tolist())
    faces = (f"f {' '.join(str(i + 1) for i in loop)}\n" for loop in _loops(content))
    _write_lines(path, vertices, faces)


def _write_off(path: Path, content: _Polygons) -> None:
    head = [f"OFF\n{len(content.points)} {len(content.sizes)} 0\n"]
    vertices = (f"{x!r} {y!r} {z!r}\n" for x, y, z in content.points.tolist())
    faces = (f"{len(loop)} {' '.join(map(str, loop))}\n" for loop in _loops(content))
    _write_lines(path, head, vertices, faces)


def _write_stl(path: Path, content: _Polygons) -> None:
    surface = content.triangles()
    corners = surface.vertices[surface.faces]
    _check_single(surface.vertices)
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    rows = np.zeros(len(corners), record)
    length = np.linalg.norm(surface.face_vectors, axis=1, keepdims=True)
    rows["normal"] = surface.face_vectors / np.where(length > 0, length, 1)
    rows["corners"] = corners
    with path.open("wb") as file:
        file.write(b"simplexmesh".ljust(80) + len(rows).to_bytes(4, "little"))
        file.write(rows.tobytes())


def _check_single(points: Array) -> None:
    """Refuse coordinates that single precision cannot represent, and warn of rounding above NOTABLE_ROUNDING."""
    largest = float(np.abs(points).max())
    if largest > float(np.finfo(np.float32).max):
        raise ValueError(f"path must not end with .stl, whose largest number is 3e38, for vertices at {largest:.3g}")
    single = points.astype(np.float32)
    if not (np.ptp(single, axis=0) > 0).sum() >= 2 and (np.ptp(points, axis=0) > 0).sum() >= 2:
        raise ValueError("path must not end with .stl, whose single precision cannot tell these vertices apart")
    off = float(np.abs(points - single).max())
    if off > NOTABLE_ROUNDING * float(np.ptp(points, axis=0).max()):
        warn(f"STL has single precision, which moves vertices by up to {off:.2g}; all other formats have double")


def _write_xyz(path: Path, content: _Polygons) -> None:
    rows = content.points if content.normals is None else np.hstack([content.points, content.normals])
    _write_lines(path, (" ".join(map(repr, row)) + "\n" for row in rows.tolist()))


def _write_lines(path: Path, *lines: Iterable[str]) -> None:
    with path.open("w", encoding="ascii", newline="\n") as file:
        for group in lines:
            file.writelines(group)


def _loops(content: _Polygons) -> Iterable[list[int]]:
    flat = content.corners.tolist()
    at = 0
    for size in content.sizes.tolist():
        yield flat[at : at + size]
        at += size


_WRITERS: dict[str, Callable[[Path, _Polygons], None]] = {
    ".vtp": _write_vtp,
    ".ply": _write_ply,
    ".obj": _write_obj,
    ".off": _write_off,
    ".stl": _write_stl,
    ".xyz": _write_xyz,
}
