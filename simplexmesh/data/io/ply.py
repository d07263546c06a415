"""Read surfaces, points and range grids from PLY files; the only module that imports plyfile."""

from __future__ import annotations

import io
import re
import warnings
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import plyfile
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.units import known_unit
from simplexmesh.data import columns
from simplexmesh.data.io.integrity.ply import check_counts
from simplexmesh.data.io.polygons import strips, triangulated
from simplexmesh.data.io.range_grid import grid_normals
from simplexmesh.data.points import PointCloud, cloud_of_file
from simplexmesh.data.triangles import TriangleMesh

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons

Ragged = tuple[Indices, Array]
Contents = tuple[dict[str, Array], dict[str, Ragged], dict[str, str]]
"""The columns of the vertices, the lists of the other elements as sizes and entries, and the obj_info with the unit."""


def read_ply(path: Path) -> TriangleMesh | PointCloud:
    """Read a PLY file: polygons or triangle strips as a TriangleMesh, points or a range grid as a PointCloud."""
    table, lists, info = _contents(path)
    if not {"x", "y", "z"} <= table.keys():
        raise OSError(f"{path.name} must have vertices with x, y and z, not {sorted(table) or 'none'}")
    points, data = columns.points_of(table), columns.data_of(table, info[columns.ALONE].split())
    unit = known_unit(info.get("unit"))
    if lists.get("face") is not None and len(lists["face"][0]):
        return TriangleMesh(points, triangulated(points, *lists["face"]), data, unit)
    if lists.get("tristrips") is not None and len(lists["tristrips"][1]):
        sizes, flat = lists["tristrips"]
        return TriangleMesh(points, strips(np.insert(flat, np.cumsum(sizes), -1)), data, unit)
    if lists.get("range_grid") is not None:
        return PointCloud(points, _grid_normals(path, points, info, lists["range_grid"]), data, unit)
    return cloud_of_file(path.name, points, columns.normals_of(table), data, unit)


def _grid_normals(path: Path, points: Array, info: dict[str, str], grid: Ragged) -> Array:
    sizes, flat = grid
    try:
        shape = int(info["num_rows"]), int(info["num_cols"])
    except (KeyError, ValueError):
        raise OSError(f"{path.name} has a range_grid but not its num_rows and num_cols") from None
    if shape[0] * shape[1] != len(sizes) or (len(sizes) and sizes.max() > 1):
        raise OSError(f"{path.name} must have {shape[0]} x {shape[1]} cells in its range_grid, not {len(sizes)}")
    index = np.full(len(sizes), -1)
    index[sizes == 1] = flat.astype(np.int64)
    if index.max() >= len(points):
        raise OSError(f"{path.name} refers to point {index.max()} of {len(points)} in its range_grid")
    return grid_normals(points, index.reshape(shape))


def _contents(path: Path) -> Contents:
    """Return what a file contains, from all its numbers at once if it is text as it should be, else by plyfile."""
    check_counts(path)
    with path.open("rb") as file:
        beginning = file.read(100)
    try:
        with warnings.catch_warnings(action="ignore"):  # one for each empty list
            if re.match(rb"ply\s+format\s+ascii", beginning):
                with suppress(_Irregular):
                    return _text_contents(path.read_bytes())
            return _plyfile_contents(path)
    except (plyfile.PlyParseError, ValueError, KeyError, EOFError, OverflowError, MemoryError) as error:
        quoting = str(error)[:200]  # words of the file, which may have any length
        reason = "it has bytes that are no text" if isinstance(error, UnicodeError) else quoting
        raise OSError(f"{path.name} cannot be read as PLY, it is truncated or damaged: {reason}") from None


def _plyfile_contents(path: Path) -> Contents:
    triangles = {"face": {"vertex_indices": 3, "vertex_index": 3}}
    try:
        data = plyfile.PlyData.read(str(path), known_list_len=triangles)
    except (plyfile.PlyParseError, KeyError, ValueError):  # polygons: one by one
        data = plyfile.PlyData.read(str(path))
    table, lists = {}, {}
    for element in data.elements:
        listed = [p.name for p in element.properties if isinstance(p, plyfile.PlyListProperty)]
        if element.name == "vertex":
            table = {p.name: element.data[p.name] for p in element.properties if p.name not in listed}
        if listed and len(element.data):
            column = element.data[_of_indices(listed)]
            if column.dtype == object:
                lists[element.name] = (np.array([len(row) for row in column]), np.concatenate(list(column)))
            else:
                lists[element.name] = (np.full(len(column), column.shape[1]), column.ravel())
    return table, lists, _info(data)


class _Irregular(Exception):  # noqa: N818  nothing that a caller sees
    """A text file whose rows are not what its header says."""


def _text_contents(raw: bytes) -> Contents:
    """Return what plyfile would read of a text file, which takes it 3 s for a scan; also empty lines, and 2.0 for 2."""
    head, *body = re.split(rb"(?m)^end_header\s*?$", raw, maxsplit=1)
    if not body:
        raise _Irregular
    head = head.replace(b"\r\n", b"\n")
    numbers, starts, ends = _rows_of_numbers(body[0])
    element = re.compile(rb"(?m)^(element[ \t]+\S+)[ \t]+(\d+)")
    empty_head = re.sub(rb"(?m)^format\s+ascii", b"format binary_little_endian", element.sub(rb"\1 0", head))
    empty = plyfile.PlyData.read(io.BytesIO(empty_head + b"end_header\n"))
    table: dict[str, Array] = {}
    lists: dict[str, Ragged] = {}
    at = 0
    for part, (_, digits) in zip(empty.elements, element.findall(head), strict=True):
        count = int(digits)
        if len(ends) < at + count:
            raise _Irregular
        single, ragged = _columns(part.properties, numbers, starts[at : at + count], ends[at : at + count])
        at += count
        if part.name == "vertex":
            table = single
        if ragged and count:
            lists[part.name] = ragged[_of_indices(list(ragged))]
    return table, lists, _info(empty)


def _rows_of_numbers(text: bytes) -> tuple[Array, Indices, Indices]:
    """Return the numbers of a text, and where each row that has any starts and ends (n,) among them."""
    letters = np.frombuffer(text, np.uint8)
    blank = np.append(True, letters <= 32)  # of which NumPy refuses what bytes.split does not take as such
    at = np.flatnonzero(blank[:-1] & ~blank[1:])
    try:
        with warnings.catch_warnings(action="error"):
            numbers = np.fromstring(text, np.float64, sep=" ")
    except (DeprecationWarning, ValueError):  # what NumPy says of words, in its versions
        raise _Irregular from None
    lines = np.flatnonzero((letters == 10) | (letters == 13))
    row = np.searchsorted(lines, at)
    starts = np.flatnonzero(np.append(True, row[1:] != row[:-1])[: len(at)])
    if len(numbers) != len(at):
        raise _Irregular
    return numbers, starts, np.append(starts[1:], len(at))[: len(starts)]


def _columns(properties: Any, numbers: Array, starts: Indices, ends: Indices) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the columns and the lists of an element by name; its rows start and end (n,) there among the numbers."""
    table, lists, at = {}, {}, starts.copy()
    for each in properties:
        if (at >= ends).any():
            raise _Irregular
        if not isinstance(each, plyfile.PlyListProperty):
            table[each.name] = _exactly(numbers[at], each.val_dtype)
            at += 1
            continue
        sizes = _exactly(numbers[at], each.len_dtype).astype(np.int64)
        at += 1
        if (sizes < 0).any() or (sizes > ends - at).any():
            raise _Irregular
        inside = np.repeat(at - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
        lists[each.name] = sizes, _exactly(numbers[inside], each.val_dtype)
        at += sizes
    if not np.array_equal(at, ends):
        raise _Irregular
    return table, lists


def _exactly(values: Array, kind: str) -> NDArray[Any]:
    """Return numbers in the type that the header says, which must hold them if it is one of whole numbers."""
    out = values.astype(kind)
    if out.dtype.kind != "f" and not np.array_equal(out, values):
        raise _Irregular
    return out


def _info(data: plyfile.PlyData) -> dict[str, str]:
    """Return the words of the obj_info, the unit of a comment `unit mm`, and the columns that make no array."""
    alone = " ".join(line.removeprefix(columns.ALONE) for line in data.comments if line.startswith(columns.ALONE))
    comments = (line.replace(":", " ") for line in data.comments if line.lower().lstrip().startswith("unit"))
    pairs = [words for words in map(str.split, (*comments, *data.obj_info)) if len(words) == 2]
    return {columns.ALONE: alone} | {"unit" if key.lower() in ("unit", "units") else key: value for key, value in pairs}


def _of_indices(names: list[str]) -> str:
    """Return the list property that holds the corners of faces: texture coordinates may come before it."""
    return next((name for name in names if name in ("vertex_indices", "vertex_index")), names[0])


_PLY_TYPES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float",
    "f8": "double",
}  # fmt: skip


def write_ply(path: Path, content: Polygons) -> None:
    """Write points, with normals and arrays, and polygons, little-endian."""
    table = dict(zip("xyz", content.points.T, strict=True))
    if content.normals is not None:
        table |= dict(zip(("nx", "ny", "nz"), content.normals.T, strict=True))
    single: set[str] = set()
    for name, values in columns.columns_of(content.data):
        plain = re.sub(r"[^!-~]", "_", name) or "_"
        single |= {plain} if name in content.data else set()
        if content.normals is None and any(plain in names for names in columns.NORMALS):
            raise ValueError(f"array {name!r} must have another name to be saved as PLY, where it is of the normals")
        if plain in table:
            raise ValueError(f"arrays must have names of their own to be saved as PLY, not {name!r} twice")
        table[plain] = _ply_numbers(name, values)
    count = "uchar" if not len(content.sizes) or content.sizes.max() < 256 else "int"
    header = ["ply", "format binary_little_endian 1.0", *([f"comment unit {content.unit}"] if content.unit else ())]
    alone: set[str] = set()
    while missed := single - columns.data_of(table, alone).keys():
        alone |= missed
    header += [f"comment {columns.ALONE}{name}" for name in sorted(alone)]
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
