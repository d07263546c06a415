"""Read surfaces or points from OFF files; colors and comments are skipped, polygons triangulated."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplexmesh.data import formats
from simplexmesh.data.points import PointCloud
from simplexmesh.data.polygons import triangulated
from simplexmesh.data.triangles import TriangleMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Polygons = tuple[Indices, Array]


def read_off(path: Path) -> TriangleMesh | PointCloud:
    """Read an OFF file (also COFF, NOFF, ...; text only), polygons triangulated; points if it has no faces.

    Raises
    ------
    OSError
        The file is damaged or truncated.
    """
    text = path.read_text(encoding="latin-1").removeprefix(formats.MARK)
    text = re.sub(r"#.*", "", text)
    keyword, _, body = text.lstrip().partition("OFF")
    if body[:8].strip().upper().startswith("BINARY"):
        raise OSError(f"{path.name} is a binary OFF file; only text is supported")
    numbers = body.split(maxsplit=3)
    n_vertices, n_faces, lines = 0, 0, list[str]()
    try:
        n_vertices, n_faces = int(numbers[0]), int(numbers[1])
        lines = [line for line in numbers[3].splitlines() if line.strip()]
        if "4" in keyword:
            raise ValueError
        vertices, lists = _content(lines, n_vertices, n_faces, keyword)
        faces = triangulated(vertices[:, :3], *lists)
    except (ValueError, IndexError, DeprecationWarning):
        wrong = "is not an OFF file of numbers x y z and polygons, or is damaged"
        if len(lines) < n_vertices + n_faces:
            wrong = f"must have {n_vertices:,} vertices and {n_faces:,} faces, it has {len(lines):,} lines: truncated"
        raise OSError(f"{path.name} {wrong}") from None
    return TriangleMesh(vertices[:, :3], faces) if n_faces else PointCloud(vertices[:, :3])


def _content(lines: list[str], n_vertices: int, n_faces: int, keyword: str) -> tuple[Array, Polygons]:
    """Return the vertices and polygons of lines that hold one each, or else of numbers separated by any white space."""
    try:
        if len(lines) >= n_vertices + n_faces:
            vertices = _numbers(lines[:n_vertices]).reshape(n_vertices, -1)
            if vertices.shape[1] >= 3:
                return vertices, _polygons(lines[n_vertices : n_vertices + n_faces])
    except (ValueError, IndexError):
        pass
    found = _free(lines, n_vertices, n_faces, keyword)
    if found is None:
        raise ValueError
    return found


def _free(lines: list[str], n_vertices: int, n_faces: int, keyword: str) -> tuple[Array, Polygons] | None:
    """Return vertices and polygons separated by any white space; only polygons on lines of their own have colors."""
    numbers = _numbers(lines)
    width = 3 + 3 * ("N" in keyword) + 2 * ("ST" in keyword)
    for colors in (4, 3) if "C" in keyword else (0,):
        used = n_vertices * (width + colors)
        if used > len(numbers):
            continue
        vertices = numbers[:used].reshape(n_vertices, -1)
        polygons = _consecutive(numbers[used:], n_faces)
        if polygons is None and 0 < n_faces <= len(lines) and _numbers(lines[:-n_faces]).size == used:
            polygons = _polygons(lines[-n_faces:])
        if polygons is not None and not np.setdiff1d(polygons[1], np.arange(n_vertices)).size:
            return vertices, polygons
    return None


def _consecutive(numbers: Array, n_faces: int) -> Polygons | None:
    """Return the sizes and corners of polygons if there are as many, each preceded by its size, and nothing else."""
    values = numbers.tolist()
    at = 0
    starts: list[int] = []
    while at < len(values) and len(starts) < n_faces and values[at] >= 1 and values[at].is_integer():
        starts.append(at)
        at += 1 + int(values[at])
    if at != len(values) or len(starts) != n_faces:
        return None
    return numbers[starts].astype(np.int64), np.delete(numbers, starts)


def _numbers(lines: list[str]) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        return np.fromstring("\n".join(lines), sep=" ")


def _polygons(lines: list[str]) -> Polygons:
    """Return the sizes and the corners of polygons, one a line, those of equal size together."""
    sizes = np.array([int(line.split(maxsplit=1)[0]) for line in lines], dtype=np.int64)
    corners = [np.zeros(0)]
    for size in np.unique(sizes):
        rows = [lines[i] for i in np.flatnonzero(sizes == size)]
        flat = _numbers(rows)
        if flat.size == len(rows) * (size + 1):
            table = flat.reshape(len(rows), size + 1)[:, 1:]
        else:
            table = np.array([row.split()[1 : size + 1] for row in rows], dtype=float)
            if table.shape != (len(rows), size):
                raise ValueError
        corners.append(table.reshape(-1))
    return np.sort(sizes), np.concatenate(corners)
