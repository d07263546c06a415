"""Whether a VTP or VTI file is as programs write it: every array where it is said to be, of the size it must have.

The readers of VTK trust what the elements say, and end the process where it is not so. What is not plain is read in
another process.
"""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

_TYPES = {f"{kind}{8 * size}": f"<{kind[0].lower()}{size}" for kind in ("Int", "UInt") for size in (1, 2, 4, 8)}
_TYPES |= {"Float32": "<f4", "Float64": "<f8", "String": "<i1"}
_CELLS = ("Verts", "Lines", "Strips", "Polys")
_APPENDED = re.compile(rb'<AppendedData\s+encoding="raw"\s*>\s*_')
_NUMBER = re.compile(r"[\d\s.eE+-]*")
_LARGEST = 1 << 40  # values of one array
_RANGES = ("L2_NORM_RANGE", "L2_NORM_FINITE_RANGE")


class _NotPlainError(Exception):
    """Something that is not as programs write it."""


def is_plain(path: Path) -> bool:
    """Whether a file holds one piece of polygons, points or an image, with all the arrays that it says."""
    try:
        _Piece(path.read_bytes()).check()
    except ElementTree.ParseError as error:
        raise OSError(f"{path.name} is not well-formed XML: {error}") from None
    except (_NotPlainError, ValueError, KeyError, IndexError, OverflowError, zlib.error):
        return False
    return True


class _Piece:
    """The only piece of a file, and the bytes that its arrays refer to."""

    def __init__(self, content: bytes) -> None:
        found = _APPENDED.search(content)
        text = content[: found.start()] + b"</VTKFile>" if found else content
        self.appended = memoryview(content)[found.end() :] if found else memoryview(b"")
        if b"<!" in text or b"<?" in text[8:]:
            raise _NotPlainError
        self.root = ElementTree.fromstring(text)
        if self.root.tag != "VTKFile" or self.root.get("byte_order") != "LittleEndian":
            raise _NotPlainError
        self.word = np.dtype({"UInt32": "<u4", "UInt64": "<u8"}[self.root.get("header_type", "UInt32")])
        self.packed = self.root.get("compressor")
        if self.packed not in (None, "vtkZLibDataCompressor"):
            raise _NotPlainError

    def check(self) -> None:
        kind = self.root.attrib["type"]
        (dataset,) = self.root
        names = [each.tag for each in dataset]
        if dataset.tag != kind or names not in (["Piece"], ["FieldData", "Piece"]):
            raise _NotPlainError
        for array in dataset[0] if len(dataset) == 2 else ():
            self._array(array, _whole(array.attrib["NumberOfTuples"]))
        groups = {each.tag: each for each in dataset[-1]}
        if len(groups) != len(dataset[-1]):
            raise _NotPlainError
        if kind == "PolyData":
            n_points, n_cells = self._surface(dataset[-1], groups)
        elif kind == "ImageData":
            n_points, n_cells = _grid(dataset, dataset[-1])
        else:
            raise _NotPlainError
        for array in groups.pop("PointData", ()):
            self._array(array, n_points)
        for array in groups.pop("CellData", ()):
            self._array(array, n_cells)
        if groups:
            raise _NotPlainError

    def _surface(self, piece: Any, groups: dict[str, Any]) -> tuple[int, int]:
        """Check positions and cells; return the numbers of points and of cells."""
        n_points, n_cells = _whole(piece.attrib["NumberOfPoints"]), 0
        (positions,) = groups.pop("Points")
        if _components(positions) != 3 or not positions.get("type", "").startswith("Float"):
            raise _NotPlainError
        self._array(positions, n_points)
        for name in _CELLS:
            count = _whole(piece.get(f"NumberOf{name}", "0"))
            found = list(groups.pop(name, ()))
            arrays = {each.get("Name"): each for each in found}
            n_cells += count
            if not found and not count:
                continue
            if len(found) != 2 or arrays.keys() != {"connectivity", "offsets"}:
                raise _NotPlainError
            ends = self._values(arrays["offsets"], count)
            n_corners = int(ends[-1]) if count else 0
            self._values(arrays["connectivity"], n_corners)
            if count and not (ends[0] >= 0 and (ends[1:] >= ends[:-1]).all()):
                raise _NotPlainError
        return n_points, n_cells

    def _array(self, array: Any, n_tuples: int) -> None:
        """Check that an array has the size of so many tuples; strings, that each of them ends."""
        if array.tag not in ("DataArray", "Array") or (array.get("type") == "String") != (array.tag == "Array"):
            raise _NotPlainError
        if _whole(array.get("NumberOfTuples", str(n_tuples))) != n_tuples:
            raise _NotPlainError
        if array.tag == "Array":
            letters = self._values(array, None)
            if np.count_nonzero(letters == 0) != n_tuples or (len(letters) and letters[-1]):
                raise _NotPlainError
        else:
            self._checked(array, n_tuples * _components(array))

    def _values(self, array: Any, count: int | None) -> NDArray[Any]:
        """Return the values of an array of whole numbers."""
        if array.get("type") not in ("Int32", "Int64", "String") or _components(array) != 1:
            raise _NotPlainError
        if count is not None and _whole(array.get("NumberOfTuples", str(count))) != count:
            raise _NotPlainError
        held = self._checked(array, count)
        if isinstance(held, np.ndarray):
            return held
        data = b"".join(zlib.decompress(piece) for piece in held) if self.packed else b"".join(map(bytes, held))
        out = np.frombuffer(data, _TYPES[array.attrib["type"]])
        if count is not None and len(out) != count:
            raise _NotPlainError
        return out

    def _checked(self, array: Any, count: int | None) -> NDArray[Any] | list[Any]:
        """Return the numbers of text, or the blocks of bytes, having checked that there are as many as needed."""
        _check_ranges(array)
        dtype = np.dtype(_TYPES[array.attrib["type"]])
        if count is not None and not 0 <= count < _LARGEST:
            raise _NotPlainError
        form = array.get("format")
        if form == "ascii":
            return _numbers(array.text or "", count, dtype)
        size = None if count is None else count * dtype.itemsize
        if form == "appended":
            at = _whole(array.attrib["offset"])
            if at >= len(self.appended):
                raise _NotPlainError
            return list(self._blocks(self.appended[at:], size))
        if form != "binary":
            raise _NotPlainError
        return list(self._blocks(memoryview(self._inline((array.text or "").strip())), size))

    def _inline(self, text: str) -> bytes:
        """Return the bytes of an array written into its element, where a header of packed blocks is encoded apart."""
        if not self.packed:
            return base64.b64decode(text, validate=True)
        blocks = int(np.frombuffer(base64.b64decode(text[:16])[: self.word.itemsize], self.word)[0])
        head = 4 * -(-(3 + blocks) * self.word.itemsize // 3)
        return base64.b64decode(text[:head], validate=True) + base64.b64decode(text[head:], validate=True)

    def _blocks(self, data: memoryview, size: int | None) -> Iterator[memoryview]:
        """Yield the blocks that follow their header, which must be of `size` bytes together, unpacked."""
        width = self.word.itemsize
        if not self.packed:
            (stored,) = np.frombuffer(data, self.word, 1).tolist()
            if stored > len(data) - width or size not in (None, stored):
                raise _NotPlainError
            yield data[width : width + stored]
            return
        blocks, each, last = np.frombuffer(data, self.word, 3).tolist()
        sizes = np.frombuffer(data, self.word, blocks, 3 * width).tolist()
        whole = blocks * each if not last else max(blocks - 1, 0) * each + last
        at = (3 + blocks) * width
        if size not in (None, whole) or last > each or sum(sizes) > len(data) - at or whole > 1040 * sum(sizes):
            raise _NotPlainError
        for stored in sizes:
            yield data[at : at + stored]
            at += stored


def _grid(dataset: Any, piece: Any) -> tuple[int, int]:
    """Check the place of an image; return the numbers of points and of cells."""
    extent = np.array([int(word) for word in piece.attrib["Extent"].split()])
    if piece.attrib["Extent"].split() != dataset.attrib["WholeExtent"].split() or len(extent) != 6:
        raise _NotPlainError
    for name, count in (("Origin", 3), ("Spacing", 3), ("Direction", 9)):
        if name in dataset.attrib and not np.isfinite(_numbers(dataset.attrib[name], count, np.dtype("f8"))).all():
            raise _NotPlainError
    n, m, k = (extent[1::2] - extent[::2]).tolist()
    if min(n, m, k) < 0 or np.abs(extent).max() > 1 << 20:
        raise _NotPlainError
    return (n + 1) * (m + 1) * (k + 1), max(n, 1) * max(m, 1) * max(k, 1)


def _numbers(text: str, count: int | None, dtype: np.dtype[Any]) -> NDArray[Any]:
    words = text.split()
    if (
        (count is not None and len(words) != count)
        or not _NUMBER.fullmatch(text)
        or max(map(len, words), default=0) > 40
    ):
        raise _NotPlainError
    out = np.array(words, dtype="U40").astype("f8" if dtype.kind == "f" else "i8")
    limits = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
    if not ((out >= limits.min) & (out <= limits.max)).all():
        raise _NotPlainError
    return out


def _components(array: Any) -> int:
    out = _whole(array.get("NumberOfComponents", "1"))
    if not 0 < out <= 1000:
        raise _NotPlainError
    return out


def _check_ranges(array: Any) -> None:
    """Check what else an array holds: its range, as two numbers."""
    for key in array:
        numbers = [(each.tag, each.get("index")) for each in key]
        if key.tag != "InformationKey" or key.get("name") not in _RANGES or key.get("length") != "2":
            raise _NotPlainError
        if numbers != [("Value", "0"), ("Value", "1")]:
            raise _NotPlainError


def _whole(word: str) -> int:
    if not re.fullmatch(r"\d{1,18}", word, re.ASCII):
        raise _NotPlainError
    return int(word)
