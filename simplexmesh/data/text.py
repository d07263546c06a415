"""Read points from text: XYZ, CSV and similar, with or without a header, commas and normals."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplexmesh.data.points import PointCloud, cloud_of_file
from simplexmesh.errors import warn

Array = NDArray[np.float64]

_SEPARATORS = bytes.maketrans(b",;[]\t", b"     ")
_MARK = b"\xef\xbb\xbf"
_UNIT = re.compile(r"\s*[\[(][^\])]*[\])]$")
_OF_PARAVIEW = {f"points{mark}{i}": name for mark in ":_" for i, name in enumerate("xyz")}


def read_text(path: Path) -> PointCloud:
    """Read points, one per line: x y z, optionally nx ny nz, then any other columns.

    A header line names the columns, also with units as in ``x [mm]``, or ``Points:0`` as in ParaView's files; without
    one, columns 4 to 6 are read as normals if all have unit length. Lines beginning with # or // are comments; a first
    line with only a number (the count) is skipped.

    Raises
    ------
    OSError
        A line holds something other than numbers or differs in its number of columns, there are fewer than three
        columns, or numbers have decimal commas.

    Warns
    -----
    SimplexMeshWarning
        The header names no columns x, y and z.
    """
    header, table = _table(path.name, path.read_bytes().removeprefix(_MARK))
    if table.shape[1] < 3:
        raise OSError(f"{path.name} must have 3 columns or more, not {table.shape[1]}")
    names = _names(header)
    place = {name: column for column, name in enumerate(names)} if len(names) == table.shape[1] else {}
    known = {"x", "y", "z"} <= place.keys()
    if names and not known and not header.lstrip().startswith(("#", "//")):
        warn(f"{path.name} names no columns x, y and z: the first three were read")
    columns = [place[name] for name in "xyz"] if known else [0, 1, 2]
    return cloud_of_file(path.name, table[:, columns], _normals(table, place))


def _normals(table: Array, place: dict[str, int]) -> Array | None:
    for triple in (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")):
        if set(triple) <= place.keys():
            return table[:, [place[name] for name in triple]]
    if place or table.shape[1] < 6:
        return None
    normals = table[:, 3:6]
    return normals if (np.abs(np.linalg.norm(normals, axis=1) - 1) < 0.01).all() else None


def _table(name: str, content: bytes) -> tuple[str, Array]:
    """Return the header (empty without one) and the numbers."""
    body = re.sub(rb"^\s*Points\s*:=\s*\[", b"", content[:200]) + content[200:]
    header, body = _header(body)
    if b"#" in body or b"//" in body:
        body = re.sub(rb"(?m)(#|//).*$", b"", body)
    first = next((line for line in body.splitlines()[:1000] if line.strip()), b"")
    if _has_decimal_commas(first):
        start = first.decode("latin-1").strip()[:60]
        raise OSError(f"{name} must have decimal points, not commas as in {start!r}")
    body = body.translate(_SEPARATORS)
    if body.rstrip().endswith(b":"):
        body = body.rstrip()[:-1]
    columns = len(first.translate(_SEPARATORS).split())
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
    return header, flat.reshape(-1, columns)


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
    """Return the names of columns in lower case, without units.

    Examples
    --------
    >>> _names('id;X [mm];"Points:1"'), _names("// x y z")
    (['id', 'x', 'y'], ['x', 'y', 'z'])
    """
    plain = header.lstrip().lstrip("#/ ").strip(" \r;,\t").lower().replace('"', "")
    names = re.split(r"\s*[,;\t]\s*", plain) if re.search(r"[,;\t]", plain) else plain.split()
    names = [_UNIT.sub("", name).strip() for name in names]
    return [_OF_PARAVIEW.get(name, name) for name in names]


def _has_decimal_commas(line: bytes) -> bool:
    """Whether at least three words, separated by semicolons or spaces, are whole numbers or have one comma inside."""
    words = [word for word in re.split(rb"[;\s]+", line) if word]
    number = rb"[-+]?\d+(,\d+([eE][-+]?\d+)?)?"
    return b"," in line and len(words) > 2 and all(re.fullmatch(number, word) for word in words)


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
