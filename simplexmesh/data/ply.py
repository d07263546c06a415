"""Read surfaces, points and range grids from PLY files; the only module that imports plyfile."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import plyfile
from numpy.typing import NDArray

from simplexmesh.data.points import PointCloud, cloud_of_file
from simplexmesh.data.polygons import strips, triangulated
from simplexmesh.data.range_grid import grid_normals
from simplexmesh.data.triangles import TriangleMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Ragged = tuple[NDArray[np.int64], NDArray[np.float64]]


def read_ply(path: Path) -> TriangleMesh | PointCloud:
    """Read a PLY file: polygons or triangle strips as a TriangleMesh, points or a range grid as a PointCloud.

    Points of a Stanford range scan (element `range_grid`) get the normals of the triangulated grid.

    Raises
    ------
    OSError
        The file is damaged or truncated.
    """
    try:
        head, info, start = _header(path)
    except (ValueError, IndexError):
        raise OSError(f"{path.name} is a PLY file with a damaged header") from None
    table, lists = _ascii(path, head, start) if info["format"] == "ascii" else _binary(path)
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


def _header(path: Path) -> tuple[list[tuple[str, int, list[list[str]]]], dict[str, str], int]:
    """Return the elements (name, count, properties), the header's format and obj_info entries, and its length."""
    elements: list[tuple[str, int, list[list[str]]]] = []
    info: dict[str, str] = {}
    complete = False
    length = 0
    with path.open("rb") as file:
        for raw in file:
            words = raw.decode("latin-1").split()
            length += len(raw)
            if words == ["end_header"]:
                complete = True
                break
            if words[:1] == ["format"]:
                info["format"] = words[1]
            elif words[:1] == ["obj_info"] and len(words) == 3:
                info[words[1]] = words[2]
            elif words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
            elif words[:1] == ["property"] and elements:
                elements[-1][2].append(words[1:])
                if len(words) != (5 if words[1] == "list" else 3):
                    raise ValueError
    if not complete or "format" not in info or not elements:
        raise OSError(f"{path.name} is a PLY file with a damaged header")
    return elements, info, length


def _ascii(
    path: Path, elements: list[tuple[str, int, list[list[str]]]], start: int
) -> tuple[dict[str, Array], dict[str, Ragged]]:
    """Parse all numbers of a text body at once; plyfile takes a second for one range scan."""
    body = path.read_bytes()[start:]
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            numbers = np.fromstring(body, sep=" ")
        except (DeprecationWarning, ValueError):
            raise OSError(f"{path.name} is a text PLY file with non-numeric data") from None
    at = 0
    table: dict[str, Array] = {}
    lists: dict[str, Ragged] = {}
    for name, count, properties in elements:
        if any(words[0] == "list" for words in properties):
            try:
                found = _ascii_lists(numbers[at:], count, properties)
            except (ValueError, OverflowError):
                raise OSError(
                    f"{path.name} is damaged: the lists of its {name} elements have invalid lengths"
                ) from None
            at += found[2] if found else len(numbers) + 1
            if found:
                lists[name] = found[:2]
        else:
            size = count * len(properties)
            rows = numbers[at : at + size]
            at += size
            if name == "vertex" and len(rows) == size:
                table = {words[1]: rows[i :: len(properties)] for i, words in enumerate(properties)}
        if at > len(numbers):
            raise OSError(f"{path.name} ends before its {count:,} {name} elements are complete: truncated")
    return table, lists


def _ascii_lists(numbers: Array, count: int, properties: list[list[str]]) -> tuple[Indices, Array, int] | None:
    """Return sizes, entries and the count of numbers read for an element's list of indices."""
    values = numbers.tolist()
    kinds = [words[0] == "list" for words in properties]
    chosen = [words[-1] for words in properties].index(_of_indices([w[-1] for w in properties if w[0] == "list"]))
    at = 0
    sizes = np.zeros(count, dtype=np.int64)
    starts = np.zeros(count, dtype=np.int64)
    try:
        for row in range(count):
            for i, is_list in enumerate(kinds):
                size = int(values[at]) if is_list else 0
                if size < 0:
                    raise ValueError
                if i == chosen:
                    sizes[row], starts[row] = size, at + 1
                at += size + 1
    except IndexError:
        return None
    if at > len(numbers):
        return None
    inside = np.repeat(starts - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
    return sizes, numbers[inside], at


def _binary(path: Path) -> tuple[dict[str, Array], dict[str, Ragged]]:
    try:
        try:
            triangles = {"face": {"vertex_indices": 3, "vertex_index": 3}}
            data = plyfile.PlyData.read(str(path), known_list_len=triangles)
        except (plyfile.PlyParseError, KeyError, ValueError):
            data = plyfile.PlyData.read(str(path))
    except (plyfile.PlyParseError, ValueError, KeyError, EOFError) as error:
        raise OSError(f"{path.name} cannot be read as PLY, perhaps truncated: {error}") from None
    table = {}
    lists = {}
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
    return table, lists


def _of_indices(names: list[str]) -> str:
    """Return the list property that holds the corners of faces: texture coordinates may come before it."""
    return next((name for name in names if name in ("vertex_indices", "vertex_index")), names[0])
