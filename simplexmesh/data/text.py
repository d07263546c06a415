"""Read points from text: XYZ, CSV and similar, with or without a header, commas and normals."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplexmesh.data.points import PointCloud, cloud_of_file

Array = NDArray[np.float64]

_SEPARATORS = bytes.maketrans(b",;[]\t", b"     ")


def read_text(path: Path) -> PointCloud:
    """Read points, one per line: x y z, optionally nx ny nz, then any other columns.

    A header line names the columns; without one, columns 4 to 6 are read as normals if all have unit length.
    Lines beginning with # or // are comments; a first line with only a number (the count) is skipped.

    Raises
    ------
    OSError
        A line holds something other than numbers or differs in its number of columns, or there are fewer than three
        columns.
    """
    names, table = _table(path.name, path.read_bytes())
    if table.shape[1] < 3:
        raise OSError(f"{path.name} must have 3 columns or more, not {table.shape[1]}")
    place = {name: column for column, name in enumerate(names)}
    columns = [place[name] for name in "xyz"] if {"x", "y", "z"} <= place.keys() else [0, 1, 2]
    return cloud_of_file(path.name, table[:, columns], _normals(table, place))


def _normals(table: Array, place: dict[str, int]) -> Array | None:
    for triple in (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")):
        if set(triple) <= place.keys():
            return table[:, [place[name] for name in triple]]
    if place or table.shape[1] < 6:
        return None
    normals = table[:, 3:6]
    return normals if (np.abs(np.linalg.norm(normals, axis=1) - 1) < 0.01).all() else None


def _table(name: str, content: bytes) -> tuple[list[str], Array]:
    """Return the column names (empty without a header) and the numbers."""
    body = re.sub(rb"^\s*Points\s*:=\s*\[", b"", content[:200]) + content[200:]
    body = body.translate(_SEPARATORS)
    if body.rstrip().endswith(b":"):
        body = body.rstrip()[:-1]
    names, body = _header(body)
    if b"#" in body or b"//" in body:
        body = re.sub(rb"(?m)(#|//).*$", b"", body)
    first = next((line for line in body.splitlines()[:1000] if line.strip()), b"")
    columns = len(first.split())
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            flat = np.fromstring(body, sep=" ")
        except (DeprecationWarning, ValueError):
            raise OSError(_bad_line(name, body, columns)) from None
    rows = body.count(b"\n") + (not body.endswith(b"\n"))
    if flat.size != rows * columns:
        rows = sum(1 for line in body.splitlines() if line.strip())
    if not flat.size or flat.size != rows * columns:
        raise OSError(_bad_line(name, body, columns))
    return names if len(names) == columns else [], flat.reshape(-1, columns)


def _header(body: bytes) -> tuple[list[str], bytes]:
    """Split off a first line that holds column names or the number of points."""
    stripped = body.lstrip()
    line, _, rest = stripped.partition(b"\n")
    words = line.decode("latin-1").lstrip("#/ ").lower().replace('"', "").split()
    if len(words) == 1 and words[0].isdigit():
        return [], rest
    if words and not any(_is_number(word) for word in words):
        return words, rest
    return [], stripped


def _is_number(word: str | bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _bad_line(name: str, body: bytes, columns: int) -> str:
    for line in body.splitlines():
        words = line.split()
        wrong = next((word for word in words if not _is_number(word)), None)
        if wrong is not None:
            return f"{name} must hold numbers, not {wrong.decode('latin-1')[:40]!r}"
        if words and len(words) != columns:
            start = line.decode("latin-1")[:60]
            return f"{name} must have {columns} numbers on every line, not {len(words)} as in {start!r}"
    return f"{name} holds no points"
