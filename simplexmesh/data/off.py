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
    try:
        n_vertices, n_faces = int(numbers[0]), int(numbers[1])
        lines = [line for line in numbers[3].splitlines() if line.strip()]
        if len(lines) < n_vertices + n_faces:
            raise OSError(
                f"{path.name} must have {n_vertices:,} vertices and {n_faces:,} faces, "
                f"it has {len(lines):,} lines: truncated"
            )
        vertices = _numbers(lines[:n_vertices]).reshape(n_vertices, -1)
        if "4" in keyword or vertices.shape[1] < 3:
            raise ValueError
        faces = triangulated(vertices[:, :3], *_polygons(lines[n_vertices : n_vertices + n_faces]))
    except (ValueError, IndexError, DeprecationWarning):
        raise OSError(f"{path.name} is not an OFF file of numbers x y z and polygons, or is damaged") from None
    return TriangleMesh(vertices[:, :3], faces) if n_faces else PointCloud(vertices[:, :3])


def _numbers(lines: list[str]) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        return np.fromstring("\n".join(lines), sep=" ")


def _polygons(lines: list[str]) -> tuple[Indices, Array]:
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
