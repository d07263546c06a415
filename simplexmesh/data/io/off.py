"""Read surfaces or points from OFF files, of which VTK refuses some varieties; damaged counts end its process."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh.data import columns
from simplexmesh.data.io import formats
from simplexmesh.data.io.polygons import triangulated
from simplexmesh.data.io.text import write_lines
from simplexmesh.data.points import PointCloud, cloud_of_file
from simplexmesh.data.triangles import TriangleMesh

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons


def read_off(path: Path) -> TriangleMesh | PointCloud:
    """Read an OFF file of text, with colors and places in a texture of its vertices; points without polygons."""
    text = re.sub(r"#.*", "", path.read_text(encoding="latin-1").removeprefix(formats.MARK))
    keyword, _, body = text.lstrip().partition("OFF")
    if body[:8].strip().upper().startswith("BINARY"):
        raise OSError(f"{path.name} is a binary OFF file; only text is supported")
    try:
        if "4" in keyword:
            raise ValueError("its vertices have four coordinates")
        n_vertices, n_faces, _, lines = body.split(maxsplit=3)
        rows = [line for line in lines.splitlines() if line.strip()]
        vertices, faces = int(n_vertices), int(n_faces)
        if len(rows) < vertices + faces:
            wrong = f"must have {vertices:,} vertices and {faces:,} faces, one a line, not {len(rows):,} lines"
            raise OSError(f"{path.name} {wrong}: truncated")
        table, left = _table(np.loadtxt(rows[:vertices], ndmin=2).T, keyword.upper())
        points, data = columns.points_of(table), columns.data_of(table)
        polygons = [line.split() for line in rows[vertices : vertices + faces]]
        sizes = np.array([row[0] for row in polygons], dtype=np.int64)
        corners = np.array([c for row, size in zip(polygons, sizes, strict=True) for c in row[1 : size + 1]], np.int64)
        if len(corners) != sizes.sum():
            raise ValueError("a polygon has fewer corners than it says")
        triangles = triangulated(points, sizes, corners)
        colored = sum(len(row) > size + 1 for row, size in zip(polygons, sizes, strict=True))
    except ValueError as error:
        raise OSError(f"{path.name} is not an OFF file of numbers x y z and polygons, or is damaged: {error}") from None
    beyond = {
        "lines after the last face": len(rows) - vertices - faces,
        "colors of faces": colored,
        f"numbers of a vertex besides those of {keyword}OFF": left,
    }
    if told := ", ".join(f"{count:,} {what}" for what, count in beyond.items() if count):
        warn(f"{path.name} has {told}, which were left out")
    if faces:
        return TriangleMesh(points, triangles, data)
    return cloud_of_file(path.name, points, columns.normals_of(table), data, None)


def _table(numbers: Array, keyword: str) -> tuple[dict[str, Array], int]:
    """Return the columns of the vertices by name, as the keyword of a file says, and how many numbers it does not."""
    normals, texture = (["nx", "ny", "nz"] if "N" in keyword else []), (["uv_0", "uv_1"] if "ST" in keyword else [])
    free = len(numbers) - 3 - len(normals) - len(texture)
    colors = ["red", "green", "blue", "alpha"][: max(free, 0)] if "C" in keyword.replace("ST", "") else []
    names = ["x", "y", "z", *normals, *colors, *texture]
    if len(numbers) < len(names) or len(colors) in (1, 2):
        raise ValueError(f"its rows have {len(numbers)} numbers, fewer than {keyword}OFF says")
    return dict(zip(names, numbers, strict=False)), len(numbers) - len(names)


def write_off(path: Path, content: Polygons) -> None:
    """Write points and polygons."""
    head = [f"OFF\n{len(content.points)} {len(content.sizes)} 0\n"]
    vertices = (f"{x!r} {y!r} {z!r}\n" for x, y, z in content.points.tolist())
    faces = (f"{len(loop)} {' '.join(map(str, loop))}\n" for loop in content.loops)
    write_lines(path, head, vertices, faces)
