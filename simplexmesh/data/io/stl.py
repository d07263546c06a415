"""STL files, written, and read by VTK, which takes bytes after the triangles for triangles and capitals for binary."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simplexmesh._base.errors import counted, warn
from simplexmesh.data.io import formats

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons


@contextmanager
def readable_by_vtk(path: Path) -> Iterator[Path]:
    """Give the path, or that of a copy that VTK reads: `solid` in lower case, no bytes at the end (with a warning)."""
    with path.open("rb") as file:
        head = file.read(formats.HEAD)
    size, stated = path.stat().st_size, formats.stl_size(head)
    longer = formats.is_binary_stl(head, size) and size > stated
    word = head.lstrip()[:5]
    if not longer and (word == b"solid" or word.lower() != b"solid" or formats.is_binary_stl(head, size)):
        yield path
        return
    content = path.read_bytes()
    if longer:
        triangles = counted((stated - 84) // 50, "triangle", "triangles")
        warn(f"{path.name} has {counted(size - stated, 'byte', 'bytes')} after its {triangles}, which were ignored")
        content = content[:stated]
    else:
        content = content.replace(word, b"solid", 1)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, path.name)
        copy.write_bytes(content)
        yield copy


def write_stl(path: Path, content: Polygons) -> None:
    """Write triangles in single precision, binary."""
    surface = content.triangles()
    corners = surface.vertices[surface.faces]
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    rows = np.zeros(len(corners), record)
    length = np.linalg.norm(surface.face_vectors, axis=1, keepdims=True)
    rows["normal"] = surface.face_vectors / np.where(length > 0, length, 1)
    rows["corners"] = corners
    with path.open("wb") as file:
        file.write(b"simplexmesh".ljust(80) + len(rows).to_bytes(4, "little"))
        file.write(rows.tobytes())
