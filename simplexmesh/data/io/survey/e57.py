"""Read and write E57 files (ASTM E2807-11): scans, each in a frame of its own; the only module that imports pye57."""

from __future__ import annotations

import re
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array
from simplexmesh._base.named_arrays import Data, is_color
from simplexmesh._base.units import NANOMETERS
from simplexmesh.data.io.integrity.survey import check_e57
from simplexmesh.data.io.survey.tables import PIECE, Columns, Parts, Table, columns_of, complaints, needed, parts_of
from simplexmesh.data.poses import rigid

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons

_POINTS_A_BYTE = 8
"""Points of which no two are the same have one bit at least."""

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ", "cartesianInvalidState")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation", "sphericalInvalidState")
_COLORS = ("colorRed", "colorGreen", "colorBlue")
_NORMALS = ("nor:normalX", "nor:normalY", "nor:normalZ")

_FIELDS = {
    "intensity": "intensity",
    "row_index": "rowIndex",
    "column_index": "columnIndex",
    "return_index": "returnIndex",
    "return_count": "returnCount",
    "time_stamp": "timeStamp",
}
"""Arrays that E57 itself has, and what it calls them."""

_WHOLE = np.longlong
"""What whole numbers pass through: pye57 takes the type that NumPy calls int64 on Linux for one of four bytes."""

_EXTENSIONS = {
    "nor": "http://www.libe57.org/E57_NOR_surface_normals.txt",
    "simplexmesh": "https://pypi.org/project/simplexmesh",
}
"""Namespaces of what E57 itself does not have: normals, and arrays of other names."""


def read_e57(path: Path) -> Parts:
    """Read the scans of an E57 file in their common frame; points that were not measured are NaN.

    The arrays are those that all scans have; and `scan`, the number of a point's scan, if there are several, and
    `viewpoint` (n, 3), where its scanner was, if all scans have a pose.
    """
    check_e57(path)
    libe57 = library().libe57
    with complaints(f"{path.name} cannot be read as E57, it is truncated or damaged"):
        image = libe57.ImageFile(str(path), "r")
        try:
            scans = _scans(path, image)
            points, normals, table = _joined(path.name, image, scans)
        finally:
            image.close()
    return parts_of(points, normals, table, "m")


def _scans(path: Path, image: Any) -> list[Any]:
    """Return all scans of a file, if together they have as many points as can be in it."""
    root = image.root()
    scans = [root["data3D"][k] for k in range(len(root["data3D"]))] if root.isDefined("data3D") else []
    n = sum(scan["points"].childCount() for scan in scans)
    if not n:
        raise OSError(f"{path.name} must have scans with points, it has none")
    if n > _POINTS_A_BYTE * path.stat().st_size:
        raise OSError(f"{path.name} must have {n:,} points by its header, more than can be in it: damaged")
    return scans


def _joined(name: str, image: Any, scans: list[Any]) -> tuple[Array, Array | None, Columns]:
    """Return the points, normals and arrays of scans in their common frame."""
    n = sum(scan["points"].childCount() for scan in scans)
    points, table, at = np.empty((n, 3)), Table(n), 0
    kept: set[str] | None = None
    for number, scan in enumerate(scans):
        pose = _pose(f"{name}: pose of scan {number}", scan)
        for piece in _pieces(image, scan):
            local, arrays = _local(name, piece), _arrays(scan, piece)
            if "normals" in arrays:
                arrays["normals"] = arrays["normals"] @ pose[:3, :3].T
            if len(scans) > 1:
                arrays["scan"] = np.full(len(local), number, np.int32)
            if scan.isDefined("pose"):
                arrays["viewpoint"] = np.tile(pose[:3, 3], (len(local), 1))
            points[at : at + len(local)] = local @ pose[:3, :3].T + pose[:3, 3]
            for key, values in arrays.items():
                table.put(key, at, values)
            kept = {*arrays} if kept is None else kept & {*arrays}
            at += len(local)
    if at < n:
        raise OSError(f"{name} must have {n:,} points, it has {at:,}: truncated")
    common = {key: column for key, column in table.items() if key in (kept or ())}
    return points, common.pop("normals", None), common


def _pose(name: str, scan: Any) -> Array:
    """Return T_world_scan."""
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    pose = scan["pose"] if scan.isDefined("pose") else None
    if pose is not None and pose.isDefined("rotation"):
        q = np.array([pose["rotation"][axis].value() for axis in "xyzw"])
        if not abs(np.linalg.norm(q) - 1) < 1e-3:
            raise OSError(f"{name} must have a quaternion of length 1, not {np.linalg.norm(q):g}")
        T[:3, :3] = Rotation.from_quat(q).as_matrix()
    if pose is not None and pose.isDefined("translation"):
        T[:3, 3] = [pose["translation"][axis].value() for axis in "xyz"]
    return rigid(name, T)


def _pieces(image: Any, scan: Any) -> Iterator[Columns]:
    """Yield the numbers of the points of a scan by the names of their fields, a piece at a time."""
    from pye57 import libe57

    count = scan["points"].childCount()
    if not count:
        return
    fields = libe57.StructureNode(scan["points"].prototype())
    buffers, rooms, kinds = libe57.VectorSourceDestBuffer(), {}, {}
    for k in range(fields.childCount()):
        name = fields.get(k).elementName()
        node = fields[name]
        if not isinstance(node, libe57.IntegerNode | libe57.ScaledIntegerNode | libe57.FloatNode):
            continue
        kinds[name] = np.dtype(np.float64) if name in _CARTESIAN[:3] + _SPHERICAL[:3] else _kind(node)
        rooms[name] = np.empty(min(PIECE, count), _WHOLE if kinds[name].kind in "iu" else kinds[name])
        buffers.append(_buffer(image, name, rooms[name]))
    reader = scan["points"].reader(buffers)
    while (n := reader.read()) > 0:
        yield {name: room[:n].astype(kinds[name]) for name, room in rooms.items()}
    reader.close()


def _buffer(image: Any, field: str, room: NDArray[Any]) -> Any:
    """Return what makes a library read a field to an array, or write it from there, as numbers in their unit."""
    from pye57 import libe57

    return libe57.SourceDestBuffer(image, field, room, len(room), doConversion=True, doScaling=True)


def _kind(node: Any) -> np.dtype[Any]:
    """Return the least type that holds all values of a field."""
    from pye57 import libe57

    if isinstance(node, libe57.IntegerNode):
        kinds = (np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32, np.int64)
        inside = [np.iinfo(kind).min <= node.minimum() <= node.maximum() <= np.iinfo(kind).max for kind in kinds]
        return np.dtype(kinds[inside.index(True)])
    single = isinstance(node, libe57.FloatNode) and node.precision() == libe57.E57_SINGLE
    return np.dtype(np.float32 if single else np.float64)


def _local(name: str, piece: Columns) -> Array:
    """Return points in the frame of their scan, those that were not measured as NaN."""
    if {*_CARTESIAN[:3]} <= piece.keys():
        points = np.stack([piece[axis] for axis in _CARTESIAN[:3]], axis=1)
        invalid = piece.get(_CARTESIAN[3])
    elif {*_SPHERICAL[:3]} <= piece.keys():
        distance, azimuth, elevation = (piece[axis] for axis in _SPHERICAL[:3])
        level = distance * np.cos(elevation)
        points = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)], axis=1)
        invalid = piece.get(_SPHERICAL[3])
    else:
        raise OSError(f"{name} must have points with cartesian or spherical coordinates, not {sorted(piece)}")
    if invalid is not None:
        points[invalid != 0] = np.nan
    return points


def _arrays(scan: Any, piece: Columns) -> Columns:
    """Return everything but the coordinates by our names: colors, normals, and the rest."""
    out: Columns = {}
    ours = {field: name for name, field in _FIELDS.items()}
    for field, values in piece.items():
        if field not in _CARTESIAN + _SPHERICAL + _COLORS + _NORMALS:
            out[ours.get(field, field.rpartition(":")[2])] = values
    if {*_COLORS} <= piece.keys():
        out["colors"] = np.stack([_bytes(scan, field, piece[field]) for field in _COLORS], axis=1)
    if {*_NORMALS} <= piece.keys():
        out["normals"] = np.stack([piece[field] for field in _NORMALS], axis=1).astype(np.float64)
    return out


def _bytes(scan: Any, field: str, values: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the values of a color as bytes: 0 and 255 for the limits that the file says."""
    low, high = 0.0, 255.0 if values.dtype == np.uint8 else 65535.0 if values.dtype.kind in "iu" else 1.0
    if scan.isDefined("colorLimits") and scan["colorLimits"].isDefined(f"{field}Maximum"):
        limits = scan["colorLimits"]
        low, high = limits[f"{field}Minimum"].value(), limits[f"{field}Maximum"].value()
    if (low, high) == (0, 255):
        return values.astype(np.uint8)
    share = (values.astype(np.float64) - low) / max(high - low, np.finfo(float).tiny)
    return np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)


def library() -> Any:
    """Return pye57, or say how it is installed."""
    with needed():
        import pye57
    return pye57


def write_e57(path: Path, content: Polygons) -> None:
    """Write points in meters, in as many scans as the array `scan` counts, each with its `viewpoint` as its origin."""
    points, normals, data, unit = content.points, content.normals, content.data, content.unit
    pye57 = library()
    factor = 1.0 if unit is None else NANOMETERS[unit] / NANOMETERS["m"]
    rest = {name: values for name, values in data.items() if name != "scan"}
    scans = [np.arange(len(points))]
    if "scan" in data and data["scan"].ndim == 1:
        scans = [np.flatnonzero(data["scan"] == number) for number in np.unique(data["scan"])]
    origins = [_origin(data.get("viewpoint"), rows) for rows in scans]
    if all(origin is not None for origin in origins):
        rest.pop("viewpoint")
    else:
        origins = [None] * len(scans)
    table = _table(points, normals, rest)
    with complaints("points cannot be written as E57"), pye57.E57(str(path), "w") as file:
        for prefix, place in _EXTENSIONS.items():
            file.image_file.extensionsAdd(prefix, place)
        for k, (rows, origin) in enumerate(zip(scans, origins, strict=True)):
            _write_scan(file, f"Scan {k}", {name: column[rows] for name, column in table.items()}, origin, factor)


def _origin(viewpoint: Any, rows: NDArray[np.int64]) -> Array | None:
    """Return the one viewpoint of some points, None if there are several or none."""
    if viewpoint is None or viewpoint.shape[1:] != (3,) or (viewpoint[rows] != viewpoint[rows[0]]).any():
        return None
    return np.asarray(viewpoint[rows[0]], np.float64)


def _table(points: Array, normals: Array | None, data: Data) -> Columns:
    """Return the columns of a file by the names of their fields."""
    rest = dict(data)
    out = dict(zip(_CARTESIAN, points.T, strict=False))
    if normals is not None:
        out |= dict(zip(_NORMALS, normals.T, strict=True))
    if "colors" in rest and is_color(rest["colors"]):
        out |= dict(zip(_COLORS, rest.pop("colors").T, strict=False))
    for name, column in columns_of(rest):
        field = _FIELDS.get(name) or "simplexmesh:" + re.sub(r"[^A-Za-z0-9_.-]", "_", name)
        if field in out:
            raise ValueError(f"arrays must have names of their own to be saved as E57, not {name!r} twice")
        if column.dtype == np.uint64 and column.max() > np.iinfo(np.int64).max:
            raise ValueError(f"array {name!r} must hold whole numbers below 2**63 to be saved as E57")
        out[field] = column
    return out


def _write_scan(file: Any, name: str, table: Columns, origin: Array | None, factor: float) -> None:
    """Write one scan, in its frame and in meters."""
    from pye57 import libe57

    image, count = file.image_file, len(table["cartesianX"])
    scan, fields = libe57.StructureNode(image), libe57.StructureNode(image)
    scan.set("guid", libe57.StringNode(image, f"{{{uuid.uuid4()}}}"))
    scan.set("name", libe57.StringNode(image, name))
    if origin is not None:
        scan.set("pose", _tree(image, {"rotation": (1, 0, 0, 0), "translation": factor * origin}))
    if "colorRed" in table:
        limits = {f"{field}{end}": value for field in _COLORS for end, value in (("Minimum", 0), ("Maximum", 255))}
        scan.set("colorLimits", _tree(image, limits))
    if "intensity" in table:
        low, high = float(table["intensity"].min()), float(table["intensity"].max())
        scan.set("intensityLimits", _tree(image, {"intensityMinimum": low, "intensityMaximum": high}))
    buffers, rooms = libe57.VectorSourceDestBuffer(), {}
    for field, column in table.items():
        fields.set(field, _node(image, column.dtype))
        kind = column.dtype if column.dtype.kind == "f" else _WHOLE
        rooms[field] = np.empty(min(PIECE, count), kind)
        buffers.append(_buffer(image, field, rooms[field]))
    points = libe57.CompressedVectorNode(image, fields, libe57.VectorNode(image, allowHeteroChildren=True))
    scan.set("points", points)
    file.data3d.append(scan)
    writer = points.writer(buffers)
    for at in range(0, count, PIECE):
        n = min(PIECE, count - at)
        for k, (field, column) in enumerate(table.items()):
            piece = column[at : at + n]
            if k < 3:
                piece = factor * (piece if origin is None else piece - origin[k])
            rooms[field][:n] = piece
        writer.write(n)
    writer.close()


def _tree(image: Any, values: Any) -> Any:
    """Return a node with numbers by name, of which those of a vector or quaternion are called x, y, z and w."""
    from pye57 import libe57

    if not isinstance(values, dict):
        if not np.ndim(values):
            return libe57.IntegerNode(image, values) if isinstance(values, int) else libe57.FloatNode(image, values)
        values = dict(zip("wxyz"[-len(values) :], map(float, values), strict=True))
    out = libe57.StructureNode(image)
    for name, value in values.items():
        out.set(name, _tree(image, value))
    return out


def _node(image: Any, kind: np.dtype[Any]) -> Any:
    """Return the prototype of a field that holds all numbers of a type."""
    from pye57 import libe57

    if kind.kind == "f":
        return libe57.FloatNode(image, 0.0, libe57.E57_DOUBLE if kind.itemsize == 8 else libe57.E57_SINGLE)
    limits = np.iinfo(kind)
    return libe57.IntegerNode(image, 0, int(limits.min), min(int(limits.max), np.iinfo(np.int64).max))
