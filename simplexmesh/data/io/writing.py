"""Write meshes and points to files of geometry, of the web and of surveys, volumes to VTI and medical formats."""

from __future__ import annotations

import gzip
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.drafts import draft
from simplexmesh._base.errors import warn
from simplexmesh._base.named_arrays import OF_MODELS, Data, is_color
from simplexmesh.data.columns import ALONE, NORMALS, columns_of, data_of
from simplexmesh.data.exporting import by_trimesh
from simplexmesh.data.io import polydata

NOTABLE_ROUNDING = 1e-4
"""Rounding by more than this fraction of the extent gives a warning."""


@dataclass(frozen=True, eq=False)
class _Polygons:
    """The content of a file: points, polygons (possibly none), normals, point data and the unit."""

    points: Array
    sizes: NDArray[Any]
    corners: NDArray[Any]
    normals: Array | None = None
    data: Data = field(default_factory=dict)
    unit: str | None = None
    topology: Any = None
    triangles: Any = None


def save(path: str | os.PathLike[str], value: Any) -> None:
    """Write a simplex mesh, triangle mesh, point cloud or volume in the format its file name says."""
    where = checks.path("path", path)
    if hasattr(value, "spacing"):
        _save_volume(where, value)
        return
    suffix = where.suffix.lower()
    if suffix not in _WRITERS:
        raise ValueError(f"path must end with one of {', '.join(_WRITERS)}, not {suffix or 'nothing'} ({where.name})")
    content = _content(value)
    if suffix not in _OF_POINTS and not len(content.sizes):
        raise ValueError(f"path must end with one of {', '.join(_OF_POINTS)} for points without faces, not {suffix}")
    with draft(where) as part:
        _WRITERS[suffix](part, content)
    _tell_what_is_lost(suffix, content.data)


def _tell_what_is_lost(suffix: str, data: Data) -> None:
    """Warn of named arrays that a format cannot hold, but for those of models."""
    holds = _HOLDS.get(suffix, lambda name, values: True)
    lost = ", ".join(name for name, values in data.items() if name not in OF_MODELS and not holds(name, values))
    if lost:
        warn(f"{suffix[1:].upper()} files do not hold these arrays, which were left out: {lost}")


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

        nifti = ".nii" in path.name.lower()[-7:]
        if nifti and volume.unit is not None:
            volume = volume.in_unit("mm")  # what ITK writes into the header
        image = SimpleITK.GetImageFromArray(volume.values.T)
        if volume.unit is not None and not nifti:
            image.SetMetaData("unit", volume.unit)
        image.SetSpacing(volume.spacing.tolist())
        image.SetOrigin(volume.origin.tolist())
        image.SetDirection(volume.direction.ravel().tolist())
        try:
            if nifti and volume.unit is None:
                _write_nifti_without_unit(image, part)
            else:
                SimpleITK.WriteImage(image, str(part), useCompression=True)
        except RuntimeError as error:
            raise OSError(f"{path.name} cannot be written: {str(error).splitlines()[-1]}") from None


def _write_nifti_without_unit(image: Any, part: Path) -> None:
    """Write a NIfTI file whose unit of length is unknown: ITK always says millimeters."""
    import SimpleITK

    from simplexmesh.data.io.integrity.volumes import nifti_unit_place

    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder, "volume.nii")
        SimpleITK.WriteImage(image, str(plain))
        with plain.open("r+b") as file:
            head = file.read(352)
            at = nifti_unit_place(head)
            file.seek(at)
            file.write(bytes([head[at] & ~7]))  # the other bits are the unit of time
            file.seek(0)
            with gzip.open(part, "wb", 6) if part.suffix == ".gz" else part.open("wb") as out:
                shutil.copyfileobj(file, out)


def to_pyvista(value: Any) -> Any:
    """Return a `pyvista.ImageData` of a volume, a `PolyData` of a mesh (a simplex mesh without its holes) or cloud."""
    import pyvista

    if not hasattr(value, "spacing"):
        return pyvista.PolyData(_dataset(_content(value)), deep=False)
    out = pyvista.ImageData(dimensions=value.shape, spacing=value.spacing, origin=value.origin)
    out.direction_matrix = value.direction
    out.point_data["values"] = value.values.flatten(order="F")
    if value.unit is not None:
        out.field_data[polydata.UNIT] = [value.unit]
    return out


def polylines(points: Array, cells: NDArray[Any]) -> Any:
    """Return a `pyvista.PolyData` of lines, each the number of its points (at least two) and their indices."""
    import pyvista

    return pyvista.PolyData(points, lines=cells) if len(cells) else pyvista.PolyData()


def _content(value: Any) -> _Polygons:
    if hasattr(value, "connectivity"):
        topology = value.connectivity
        surface = ~topology.face_is_hole
        corners = topology.face_vertices[np.repeat(surface, topology.face_sizes)]
        sizes = topology.face_sizes[surface]
        data = value.data, value.unit
        return _Polygons(value.vertices, sizes, corners, None, *data, topology, value.triangulated)
    if hasattr(value, "vertices") and hasattr(value, "faces"):
        sizes, corners = np.full(len(value.faces), 3), value.faces.reshape(-1)
        return _Polygons(value.vertices, sizes, corners, None, value.data, value.unit, triangles=lambda: value)
    if hasattr(value, "points") and hasattr(value, "normals"):
        none = np.zeros(0, dtype=np.int64)
        return _Polygons(value.points, none, none, value.normals, value.data, value.unit)
    raise TypeError(f"value must be a SimplexMesh, TriangleMesh or PointCloud, not {checks.type_name(value)}")


def _dataset(content: _Polygons) -> Any:
    data = dict(content.data)
    if content.normals is not None:
        data["Normals"] = content.normals
    return polydata.polydata(content.points, content.sizes, content.corners, data, content.topology, content.unit)


def _write_vtp(path: Path, content: _Polygons) -> None:
    for name, values in content.data.items():
        if not name or any(ord(letter) < 32 and letter not in "\t\n\r" for letter in name):
            raise ValueError(f"arrays must have printable names to be saved as VTP, not {name!r}")
        if not values[0].size:
            raise ValueError(f"array {name!r} must have columns to be saved as VTP, not shape {values.shape}")
    polydata.write_vtp(path, _dataset(content))


_PLY_TYPES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float",
    "f8": "double",
}  # fmt: skip


def _write_ply(path: Path, content: _Polygons) -> None:
    table = dict(zip("xyz", content.points.T, strict=True))
    if content.normals is not None:
        table |= dict(zip(("nx", "ny", "nz"), content.normals.T, strict=True))
    single: set[str] = set()
    for name, values in columns_of(content.data):
        plain = re.sub(r"[^!-~]", "_", name) or "_"
        single |= {plain} if name in content.data else set()
        if content.normals is None and any(plain in names for names in NORMALS):
            raise ValueError(f"array {name!r} must have another name to be saved as PLY, where it is of the normals")
        if plain in table:
            raise ValueError(f"arrays must have names of their own to be saved as PLY, not {name!r} twice")
        table[plain] = _ply_numbers(name, values)
    count = "uchar" if not len(content.sizes) or content.sizes.max() < 256 else "int"
    header = ["ply", "format binary_little_endian 1.0", *([f"comment unit {content.unit}"] if content.unit else ())]
    alone: set[str] = set()
    while missed := single - data_of(table, alone).keys():
        alone |= missed
    header += [f"comment {ALONE}{name}" for name in sorted(alone)]
    header += [f"element vertex {len(content.points)}"]
    header += [f"property {_PLY_TYPES[values.dtype.str[1:]]} {name}" for name, values in table.items()]
    if len(content.sizes):
        header += [f"element face {len(content.sizes)}", f"property list {count} int vertex_indices"]
    rows = np.zeros(len(content.points), [(name, values.dtype.newbyteorder("<")) for name, values in table.items()])
    for name, values in table.items():
        rows[name] = values
    with path.open("wb") as file:
        file.write(("\n".join([*header, "end_header"]) + "\n").encode("ascii"))
        file.write(rows.tobytes())
        file.write(_packed_lists(content.sizes, content.corners, "u1" if count == "uchar" else "<i4"))


def _ply_numbers(name: str, values: NDArray[Any]) -> NDArray[Any]:
    """Return numbers in a type that PLY has: of 64 bits as 32 or, where they do not fit, as double."""
    if values.dtype.str[1:] in _PLY_TYPES:
        return values
    kinds = {"b": (np.uint8,), "f": (np.float32, np.float64)[values.dtype.itemsize > 2 :]}
    for kind in kinds.get(values.dtype.kind, (np.int32, np.float64)):
        with np.errstate(invalid="ignore", over="ignore"):
            out = values.astype(kind)
        if values.dtype.kind == "f" or np.array_equal(out.astype(values.dtype), values):
            return out
    raise ValueError(f"array {name!r} must hold whole numbers below 2**53 to be saved as PLY")


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
    rows = content.points
    if "colors" in content.data and is_color(content.data["colors"]):
        rows = np.hstack([rows, content.data["colors"][:, :3] / 255])
    head = [f"# unit: {content.unit}\n"] if content.unit else []
    vertices = (f"v {' '.join(map(repr, row))}\n" for row in rows.tolist())
    textured = "uv" in content.data and _is_uv(content.data["uv"])
    at = (f"vt {u!r} {v!r}\n" for u, v in (content.data["uv"].tolist() if textured else ()))
    corner = "{0}/{0}" if textured else "{0}"
    faces = (f"f {' '.join(corner.format(i + 1) for i in loop)}\n" for loop in _loops(content))
    _write_lines(path, head, vertices, at, faces)


def _is_uv(values: NDArray[Any]) -> bool:
    """Whether an array holds places in a texture, as OBJ has them."""
    return values.dtype.kind == "f" and values.shape[1:] == (2,) and bool(np.isfinite(values).all())


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


def _write_las(path: Path, content: _Polygons) -> None:
    from simplexmesh.data.io.survey.las import write_las

    write_las(path, content.points, content.normals, content.data, content.unit)


def _write_e57(path: Path, content: _Polygons) -> None:
    from simplexmesh.data.io.survey.e57 import write_e57

    write_e57(path, content.points, content.normals, content.data, content.unit)


def _write_glb(path: Path, content: _Polygons) -> None:
    """Write triangles in meters, with colors, and with other arrays of up to four columns in single precision."""
    surface = _in(content.triangles(), "m")
    fitting = {name: values for name, values in surface.data.items() if _HOLDS[".glb"](name, values)}
    data = {name: v if name == "colors" else v.astype(np.float32) for name, v in fitting.items()}
    path.write_bytes(by_trimesh(replace(surface, data=data), "glb"))


def _write_3mf(path: Path, content: _Polygons) -> None:
    path.write_bytes(by_trimesh(_in(content.triangles(), "mm"), "3mf"))


def _in(surface: Any, unit: str) -> Any:
    """Return a surface of known unit in the one of a format, any other as it is."""
    return surface if surface.unit is None else surface.in_unit(unit)


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


_HOLDS: dict[str, Callable[[str, NDArray[Any]], bool]] = {
    ".obj": lambda name, values: (name == "colors" and is_color(values)) or (name == "uv" and _is_uv(values)),
    ".glb": lambda name, values: values.size <= 4 * len(values),
    **dict.fromkeys((".off", ".stl", ".xyz", ".3mf"), lambda name, values: False),
}
"""Which named arrays a file can hold, of formats that do not hold all."""

_OF_POINTS = (".vtp", ".ply", ".xyz", ".las", ".laz", ".e57")
"""Formats that hold points without faces."""

_WRITERS: dict[str, Callable[[Path, _Polygons], None]] = {
    ".vtp": _write_vtp,
    ".ply": _write_ply,
    ".obj": _write_obj,
    ".off": _write_off,
    ".stl": _write_stl,
    ".xyz": _write_xyz,
    ".las": _write_las,
    ".laz": _write_las,
    ".e57": _write_e57,
    ".glb": _write_glb,
    ".3mf": _write_3mf,
}
