"""Read points from text: XYZ, CSV and similar, with or without a header, commas and normals."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.units import known_unit
from simplexmesh.data.columns import are_colors, as_colors, data_of, normals_of, points_of
from simplexmesh.data.points import PointCloud, cloud_of_file

if TYPE_CHECKING:
    from simplexmesh.data.io.polydata import Polygons

_SEPARATORS = bytes.maketrans(b",;[]\t", b"     ")
_MARK = b"\xef\xbb\xbf"
_UNIT = re.compile(r"\s*[\[(][^\])]*[\])]$")
_UNIT_OF_X = re.compile(r"(?i)\bx\"?\s*[\[(]\s*(\w+)\s*[\])]")
_OF_PARAVIEW = {f"points{mark}{i}": name for mark in ":_" for i, name in enumerate("xyz")}


def read_text(path: Path) -> PointCloud:
    """Read points, one a line; a header names the columns, without one 4 to 6 are unit normals or colors."""
    header, table = _table(path.name, path.read_bytes().removeprefix(_MARK))
    if table.shape[1] < 3:
        raise OSError(f"{path.name} must have 3 columns or more, not {table.shape[1]}")
    names = _names(header)
    named = dict(zip(names, table.T, strict=True)) if len(names) == table.shape[1] else {}
    known = {"x", "y", "z"} <= named.keys()
    if names and not known and not header.lstrip().startswith(("#", "//")):
        warn(f"{path.name} names no columns x, y and z: the first three were read")
    points, data = (points_of(named), data_of(named)) if known else (table[:, :3], {})
    normals = normals_of(named)
    if not named and table.shape[1] >= 6:
        unit_vectors = (np.abs(np.linalg.norm(table[:, 3:6], axis=1) - 1) < 0.01).all()
        normals = table[:, 3:6] if unit_vectors else None
    if not named and table.shape[1] == 6 and are_colors(table[:, 3:]):
        data = {"colors": as_colors(table[:, 3:])}
    unit = _UNIT_OF_X.search(header)
    return cloud_of_file(path.name, points, normals, data, known_unit(unit[1]) if unit else None)


def _table(name: str, content: bytes) -> tuple[str, Array]:
    """Return the header (empty without one) and the numbers."""
    body = re.sub(rb"^\s*Points\s*:=\s*\[", b"", content[:200]) + content[200:]
    header, body = _header(body)
    body = re.sub(rb"(?m)(#|//).*$", b"", body).rstrip(b" \t\r\n:")
    first = body.lstrip().partition(b"\n")[0]
    if _has_decimal_commas(first):
        raise OSError(f"{name} must have decimal points, not commas as in {first.decode('latin-1').strip()[:60]!r}")
    if not body:
        raise OSError(f"{name} holds no points")
    try:
        return header, np.loadtxt(io.BytesIO(body.translate(_SEPARATORS)), ndmin=2, encoding="latin-1")
    except ValueError as error:
        reason = str(error).partition(";")[0].rstrip(".")
        raise OSError(f"{name} must hold numbers, as many on every line: {reason}") from None


def _header(body: bytes) -> tuple[str, bytes]:
    """Split off a first line that holds column names, and a line that holds the number of points."""
    header = ""
    for _ in range(2):
        stripped = body.lstrip()
        line, _, rest = stripped.partition(b"\n")
        words = line.translate(_SEPARATORS).decode("latin-1").lstrip("#/ ").split()
        is_count = len(words) == 1 and words[0].isdigit()
        if not is_count and (header or not words or any(_is_number(word) for word in words)):
            return header, stripped
        header, body = header if is_count else line.decode("latin-1"), rest
    return header, body


def _names(header: str) -> list[str]:
    """Return the names of columns in lower case, without units."""
    plain = header.lstrip().lstrip("#/ ").strip(" \r;,\t").lower().replace('"', "")
    names = re.split(r"\s*[,;\t]\s*", plain) if re.search(r"[,;\t]", plain) else plain.split()
    names = [_UNIT.sub("", name).strip() for name in names]
    return [_OF_PARAVIEW.get(name, name) for name in names]


def _has_decimal_commas(line: bytes) -> bool:
    """Whether at least three words, separated by semicolons or spaces, are whole numbers or have one comma inside."""
    words = [word for word in re.split(rb"[;\s]+", line) if word]
    number = rb"[-+]?\d+(,\d+([eE][-+]?\d+)?)?"
    return b"," in line and len(words) > 2 and all(re.fullmatch(number, word) for word in words)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def write_xyz(path: Path, content: Polygons) -> None:
    """Write points, one a line, with their normals."""
    rows = content.points if content.normals is None else np.hstack([content.points, content.normals])
    write_lines(path, (" ".join(map(repr, row)) + "\n" for row in rows.tolist()))


def write_lines(path: Path, *lines: Iterable[str]) -> None:
    """Write lines of text as all systems read them."""
    with path.open("w", encoding="ascii", newline="\n") as file:
        for group in lines:
            file.writelines(group)
