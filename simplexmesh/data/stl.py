"""STL files of other programs, as VTK reads them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simplexmesh.data import formats
from simplexmesh.errors import counted, warn


@contextmanager
def readable_by_vtk(path: Path) -> Iterator[Path]:
    """Give the path, or that of a copy under the same name that VTK reads: `solid` in lower case, no bytes at the end.

    Warns
    -----
    SimplexMeshWarning
        A binary file has bytes after its triangles.
    """
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
