"""Read surfaces, points and range grids from PLY files; the only module that imports plyfile."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import plyfile
from numpy.typing import NDArray

from simplexmesh.data.io.polygons import strips, triangulated
from simplexmesh.data.io.range_grid import grid_normals
from simplexmesh.data.points import PointCloud, cloud_of_file
from simplexmesh.data.triangles import TriangleMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Ragged = tuple[NDArray[np.int64], NDArray[np.float64]]
Contents = tuple[dict[str, Array], dict[str, Ragged], dict[str, str]]
"""The columns of the vertices, the lists of the other elements as sizes and entries, and the obj_info."""


def read_ply(path: Path) -> TriangleMesh | PointCloud:
    """Read a PLY file: polygons or triangle strips as a TriangleMesh, points or a range grid as a PointCloud."""
    table, lists, info = _contents(path)
    if not {"x", "y", "z"} <= table.keys():
        raise OSError(f"{path.name} must have vertices with x, y and z, not {sorted(table) or 'none'}")
    points = np.stack([table[c] for c in "xyz"], axis=1).astype(np.float64)
    if lists.get("face") is not None and len(lists["face"][0]):
        return TriangleMesh(points, triangulated(points, *lists["face"]))
    if lists.get("tristrips") is not None and len(lists["tristrips"][1]):
        sizes, flat = lists["tristrips"]
        return TriangleMesh(points, strips(np.insert(flat, np.cumsum(sizes), -1)))
    if lists.get("range_grid") is not None:
        return _range_scan(path, points, info, lists["range_grid"])
    if {"nx", "ny", "nz"} <= table.keys():
        normals = np.stack([table[c] for c in ("nx", "ny", "nz")], axis=1).astype(np.float64)
        return cloud_of_file(path.name, points, normals)
    return PointCloud(points)


def _range_scan(path: Path, points: Array, info: dict[str, str], grid: Ragged) -> PointCloud:
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
    return PointCloud(points, grid_normals(points, index.reshape(shape)))


def _contents(path: Path) -> Contents:
    """Return what a file contains, from all its numbers at once if it is text as it should be, else by plyfile."""
    triangles = {"face": {"vertex_indices": 3, "vertex_index": 3}}
    try:
        with warnings.catch_warnings(action="ignore"):  # one for each empty list
            if _is_text(path) and (found := _text_contents(path.read_bytes())) is not None:
                return found
            try:
                data = plyfile.PlyData.read(str(path), known_list_len=triangles)
            except (plyfile.PlyParseError, KeyError, ValueError):  # polygons: one by one
                data = plyfile.PlyData.read(str(path))
    except (plyfile.PlyParseError, ValueError, KeyError, EOFError, OverflowError, MemoryError) as error:
        raise OSError(f"{path.name} cannot be read as PLY, it is truncated or damaged: {error}") from None
    table, lists = {}, {}
    for element in data.elements:
        if element.name == "vertex":
            table = {p.name: element.data[p.name] for p in element.properties}
        listed = [p.name for p in element.properties if isinstance(p, plyfile.PlyListProperty)]
        if listed and len(element.data):
            column = element.data[_of_indices(listed)]
            if column.dtype == object:
                lists[element.name] = (np.array([len(row) for row in column]), np.concatenate(list(column)))
            else:
                lists[element.name] = (np.full(len(column), column.shape[1]), column.reshape(-1))
    return table, lists, _info(data)


def _is_text(path: Path) -> bool:
    with path.open("rb") as file:
        return re.match(rb"ply\s+format\s+ascii", file.read(100)) is not None


def _text_contents(raw: bytes) -> Contents | None:
    """Return what plyfile would read of a text file, which takes it 3 s for a scan; None if it is irregular."""
    head, *body = re.split(rb"(?m)^end_header\s*?$", raw.replace(b"\r\n", b"\n"), maxsplit=1)
    text = re.compile(rb"(?m)^format\s+ascii")
    if not body:
        return None
    try:
        numbers = np.array(body[0].split()).astype(np.float64)
    except ValueError:
        return None
    element = re.compile(rb"(?m)^(element\s+\S+)\s+(\d+)")
    empty_head = text.sub(b"format binary_little_endian", element.sub(rb"\1 0", head))
    empty = plyfile.PlyData.read(io.BytesIO(empty_head + b"end_header\n"))
    counts = [found[1] for found in element.findall(head)]
    table: dict[str, Array] = {}
    lists: dict[str, Ragged] = {}
    at = 0
    for part, count in zip(empty.elements, map(int, counts), strict=True):
        kinds = [isinstance(p, plyfile.PlyListProperty) for p in part.properties]
        names = [p.name for p in part.properties]
        if any(kinds) and part.name == "vertex":
            return None
        if any(kinds):
            chosen = names.index(_of_indices([name for name, is_list in zip(names, kinds, strict=True) if is_list]))
            found = _rows_of_lists(numbers[at:].tolist(), count, kinds, chosen)
            if found is None:
                return None
            sizes, starts, length = found
            inside = np.repeat(starts - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
            lists |= {part.name: (sizes, numbers[at:][inside])} if count else {}
            at += length
            continue
        rows = numbers[at : at + count * len(names)]
        at += count * len(names)
        if part.name == "vertex" and at <= len(numbers):
            table = {p.name: rows[i :: len(names)].astype(p.val_dtype) for i, p in enumerate(part.properties)}
    return (table, lists, _info(empty)) if at == len(numbers) else None


def _rows_of_lists(values: list[float], count: int, kinds: list[bool], chosen: int) -> tuple[Any, Any, int] | None:
    """Return sizes and starts (count,) of the chosen list in each row, and the length of all; None if they run out."""
    sizes, starts, at = np.zeros(count, np.int64), np.zeros(count, np.int64), 0
    for row in range(count):
        for column, is_list in enumerate(kinds):
            if at >= len(values) or (is_list and not (values[at] >= 0 and values[at].is_integer())):
                return None
            size = int(values[at]) if is_list else 0
            if column == chosen:
                sizes[row], starts[row] = size, at + 1
            at += size + 1
    return (sizes, starts, at) if at <= len(values) else None


def _info(data: plyfile.PlyData) -> dict[str, str]:
    return dict(words[:2] for words in map(str.split, data.obj_info) if len(words) == 2)


def _of_indices(names: list[str]) -> str:
    """Return the list property that holds the corners of faces: texture coordinates may come before it."""
    return next((name for name in names if name in ("vertex_indices", "vertex_index")), names[0])
