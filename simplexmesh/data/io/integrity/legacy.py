"""Whether a VTK file of the old kind is as programs write it: every count, every number, and nothing else.

The reader of VTK trusts counts, and crashes where numbers are missing. What is not plain is read in another process.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_TYPES = {
    b"char": "i1", b"signed_char": "i1", b"unsigned_char": "u1", b"short": "i2", b"unsigned_short": "u2", b"int": "i4",
    b"unsigned_int": "u4", b"long": "i8", b"unsigned_long": "u8", b"vtktypeint64": "i8", b"vtktypeint32": "i4",
    b"vtkidtype": "i4", b"float": "f4", b"double": "f8",
}  # fmt: skip
_HEAD = re.compile(rb"# vtk DataFile Version \d\.\d\r?\n[^\n]{0,255}\n(ASCII|BINARY)[ \t\r]*\n")
_METADATA = re.compile(
    rb"METADATA\s*\nINFORMATION \d\s*\n"
    rb"(NAME L2_NORM_(FINITE_)?RANGE LOCATION vtkDataArray\s*\nDATA 2 \S+ \S+ ?\r?\n)*\r?\n"
)
_LONGEST_LINE = 500
_NO_NUMBER = re.compile(rb"[^\d\s.eE+-]")
_NEXT = re.compile(rb"\n[^\S\n]*[A-Za-z_]")
_PLACE = {b"SPACING", b"ASPECT_RATIO", b"ORIGIN"}
_COMPONENTS = {b"NORMALS": 3, b"VECTORS": 3, b"TENSORS": 9}


class _NotPlainError(Exception):
    """Something that is not as programs write it."""


def is_plain(path: Path) -> bool:
    """Whether a file holds polygons, points or an image, with all the numbers that it says."""
    walk = _Walk(path.read_bytes())
    try:
        walk.dataset()
    except (_NotPlainError, ValueError, KeyError, IndexError, OverflowError):
        return False
    return True


def _whole(word: bytes) -> int:
    if not re.fullmatch(rb"\d{1,18}", word):
        raise _NotPlainError
    return int(word)


class _Walk:
    """The way through the sections of a file, one after the other."""

    def __init__(self, content: bytes) -> None:
        head = _HEAD.match(content)
        self.content, self.binary = content, head is not None and head[1] == b"BINARY"
        self.at = head.end() if head else len(content)
        self.n_points = self.n_cells = 0
        self.n_values = -1  # of the arrays to come: as many as points or cells

    def dataset(self) -> None:
        kind = self._line()
        if kind == [b"DATASET", b"POLYDATA"]:
            sections = {b"POINTS": self._points} | dict.fromkeys(
                (b"VERTICES", b"LINES", b"POLYGONS", b"TRIANGLE_STRIPS"), self._cells
            )
        elif kind == [b"DATASET", b"STRUCTURED_POINTS"]:
            sections = {b"DIMENSIONS": self._dimensions} | dict.fromkeys(_PLACE, self._place)
        else:
            raise _NotPlainError
        sections |= {b"POINT_DATA": self._owner, b"CELL_DATA": self._owner, b"FIELD": self._field}
        sections |= dict.fromkeys((b"SCALARS", b"TEXTURE_COORDINATES", *_COMPONENTS), self._attribute)
        while self.content[self.at :].strip():
            words = self._line()
            sections[words[0]](words)
            if found := _METADATA.match(self.content, self._after_space()):
                self.at = found.end()

    def _after_space(self) -> int:
        at = self.at
        while self.content[at : at + 1] in (b"\n", b"\r"):
            at += 1
        return at

    def _line(self) -> list[bytes]:
        words: list[bytes] = []
        while not words:
            end = self.content.find(b"\n", self.at, self.at + _LONGEST_LINE)
            if end < 0:
                raise _NotPlainError
            words, self.at = self.content[self.at : end].split(), end + 1
        return words

    def _numbers(self, count: int, kind: bytes) -> NDArray[Any]:
        """Return the next numbers, which must be exactly that many; in text they end before the next word."""
        dtype = np.dtype(_TYPES[kind.lower()])
        if not 0 <= count <= len(self.content):
            raise _NotPlainError
        if self.binary:
            start = self.at
            self.at += count * dtype.itemsize
            return np.frombuffer(self.content, dtype.newbyteorder(">"), count, start)
        found = _NEXT.search(self.content, max(self.at - 1, 0))
        end = found.start() if found else len(self.content)
        text = self.content[self.at : end]
        words = text.split()
        self.at = end
        if len(words) != count or _NO_NUMBER.search(text) or (count and max(map(len, words)) > 40):
            raise _NotPlainError
        real = dtype.kind == "f"
        out = np.fromiter(map(float if real else int, words), "f8" if real else "i8", count)
        limits = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
        if not ((out >= limits.min) & (out <= limits.max)).all():
            raise _NotPlainError
        return out

    def _points(self, words: list[bytes]) -> None:
        self.n_points = _whole(words[1])
        self._numbers(3 * self.n_points, words[2])

    def _cells(self, words: list[bytes]) -> None:
        """Check cells: sizes with corners in one list, or since version 5 offsets and corners."""
        first, second = _whole(words[1]), _whole(words[2])
        following = self.content[self.at : self.at + 20].split()
        if following[:1] == [b"OFFSETS"]:
            ends = self._numbers(first, self._line()[1])
            self._numbers(second, self._line()[1])
            count = max(first - 1, 0)
            if len(ends) and (ends[0] != 0 or ends[-1] != second or (ends[1:] < ends[:-1]).any()):
                raise _NotPlainError
        else:
            numbers, at, count = self._numbers(second, b"int").tolist(), 0, first
            for _ in range(first):
                size = int(numbers[at])
                at += size + 1
                if size < 0 or at > second:
                    raise _NotPlainError
            if at != second:
                raise _NotPlainError
        self.n_cells += count

    def _dimensions(self, words: list[bytes]) -> None:
        n, m, k = (_whole(word) for word in words[1:])
        if not 0 < min(n, m, k) <= max(n, m, k) < 1 << 20:
            raise _NotPlainError
        self.n_points, self.n_cells = n * m * k, max(n - 1, 1) * max(m - 1, 1) * max(k - 1, 1)

    def _place(self, words: list[bytes]) -> None:
        if len(words) != 4 or not np.isfinite(np.array(words[1:]).astype(float)).all():
            raise _NotPlainError

    def _owner(self, words: list[bytes]) -> None:
        self.n_values = _whole(words[1])
        if self.n_values != (self.n_points if words[0] == b"POINT_DATA" else self.n_cells):
            raise _NotPlainError

    def _attribute(self, words: list[bytes]) -> None:
        """Check an array with a role, such as normals."""
        if self.n_values < 0:
            raise _NotPlainError
        components = _COMPONENTS.get(words[0], 1)
        if words[0] == b"TEXTURE_COORDINATES":
            components, kind = _whole(words[2]), words[3]
        else:
            kind = words[2]
            components = _whole(words[3]) if words[0] == b"SCALARS" and len(words) > 3 else components
        if words[0] == b"SCALARS" and self._line() != [b"LOOKUP_TABLE", b"default"]:
            raise _NotPlainError
        if not 0 < components < 10:
            raise _NotPlainError
        self._numbers(components * self.n_values, kind)

    def _field(self, words: list[bytes]) -> None:
        """Check a list of named arrays; those of the data set have any size, others that of points or cells."""
        for _ in range(min(_whole(words[2]), 1000)):
            _, components, count, kind = self._line()
            if _whole(components) < 1 or self.n_values not in (-1, _whole(count)):
                raise _NotPlainError
            self._numbers(_whole(components) * _whole(count), kind)
            if found := _METADATA.match(self.content, self._after_space()):
                self.at = found.end()
