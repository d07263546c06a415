"""Read surfaces or points from OFF files, of which VTK refuses some varieties; damaged counts end its process."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from simplexmesh.data.io import formats
from simplexmesh.data.io.polygons import triangulated
from simplexmesh.data.points import PointCloud
from simplexmesh.data.triangles import TriangleMesh


def read_off(path: Path) -> TriangleMesh | PointCloud:
    """Read an OFF file (also COFF, NOFF, ...; text only), polygons triangulated; points if it has no faces."""
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
        points = np.loadtxt(rows[:vertices], usecols=(0, 1, 2), ndmin=2)
        polygons = [line.split() for line in rows[vertices : vertices + faces]]
        sizes = np.array([row[0] for row in polygons], dtype=np.int64)
        corners = np.array([c for row, size in zip(polygons, sizes, strict=True) for c in row[1 : size + 1]], np.int64)
        if len(corners) != sizes.sum():
            raise ValueError("a polygon has fewer corners than it says")
        triangles = triangulated(points, sizes, corners)
    except ValueError as error:
        raise OSError(f"{path.name} is not an OFF file of numbers x y z and polygons, or is damaged: {error}") from None
    return TriangleMesh(points, triangles) if faces else PointCloud(points)
