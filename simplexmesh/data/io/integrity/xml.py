"""Whether a VTP or VTI file is as programs write it: every array where it is said to be, of the size it must have.

The readers of VTK trust what the elements say, and end the process where it is not so: what is not plain is read apart.
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
_COUNT = re.compile(rb"\b(NumberOf[A-Z][a-z]+)\s*=\s*[\"']\s*([-+\d][-+\d.eE]*)")
_PACKING = 1040  # to how many bytes zlib unpacks one
_LARGEST = 1 << 40  # values of one array
_RANGES = ("L2_NORM_RANGE", "L2_NORM_FINITE_RANGE")


class _NotPlainError(Exception):
    """Something that is not as programs write it."""


def _require(plain: bool) -> None:  # noqa: FBT001
    if not plain:
        raise _NotPlainError


def is_plain(path: Path) -> bool:
    """Whether a file holds one piece of polygons, points or an image, with all the arrays that it says.

    Counts below zero or beyond what so many bytes can unpack to are refused: VTK would allocate that, or read on.
    """
    content = path.read_bytes()
    found = _APPENDED.search(content)
    for name, number in _COUNT.findall(content, 0, found.start() if found else len(content)):
        if not number.removeprefix(b"+").isdigit() or len(number) > 18 or int(number) > _PACKING * len(content):
            raise OSError(f"{path.name} is damaged: {name.decode()} is {number.decode()[:40]}")
    try:
        _Piece(content).check()
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
        _require(b"<!" not in text and b"<?" not in text[8:])
        self.root = ElementTree.fromstring(text)
        _require(self.root.tag == "VTKFile" and self.root.get("byte_order") == "LittleEndian")
        self.word = np.dtype({"UInt32": "<u4", "UInt64": "<u8"}[self.root.get("header_type", "UInt32")])
        self.packed = self.root.get("compressor")
        _require(self.packed in (None, "vtkZLibDataCompressor"))

    def check(self) -> None:
        kind = self.root.attrib["type"]
        (dataset,) = self.root
        names = [each.tag for each in dataset]
        _require(dataset.tag == kind and names in (["Piece"], ["FieldData", "Piece"]))
        for array in dataset[0] if len(dataset) == 2 else ():
            self._array(array, _whole(array.attrib["NumberOfTuples"]))
        groups = {each.tag: each for each in dataset[-1]}
        _require(len(groups) == len(dataset[-1]) and kind in ("PolyData", "ImageData"))
        counts = self._surface(dataset[-1], groups) if kind == "PolyData" else _grid(dataset, dataset[-1])
        for name, count in zip(("PointData", "CellData"), counts, strict=True):
            for array in groups.pop(name, ()):
                self._array(array, count)
        _require(not groups)

    def _surface(self, piece: Any, groups: dict[str, Any]) -> tuple[int, int]:
        """Check positions and cells; return the numbers of points and of cells."""
        n_points, n_cells = _whole(piece.attrib["NumberOfPoints"]), 0
        (positions,) = groups.pop("Points")
        _require(_components(positions) == 3 and positions.get("type", "").startswith("Float"))
        self._array(positions, n_points)
        for name in _CELLS:
            count = _whole(piece.get(f"NumberOf{name}", "0"))
            found = list(groups.pop(name, ()))
            arrays = {each.get("Name"): each for each in found}
            n_cells += count
            if not found and not count:
                continue
            _require(len(found) == 2 and arrays.keys() == {"connectivity", "offsets"})
            ends = self._values(arrays["offsets"], count)
            n_corners = int(ends[-1]) if count else 0
            self._values(arrays["connectivity"], n_corners)
            _require(not count or bool(ends[0] >= 0 and (ends[1:] >= ends[:-1]).all()))
        return n_points, n_cells

    def _array(self, array: Any, n_tuples: int) -> None:
        """Check that an array has the size of so many tuples; strings, that each of them ends."""
        _require(array.tag == ("Array" if array.get("type") == "String" else "DataArray"))
        _require(_whole(array.get("NumberOfTuples", str(n_tuples))) == n_tuples)
        if array.tag == "Array":
            letters = self._values(array, None)
            _require(np.count_nonzero(letters == 0) == n_tuples and not letters[-1:].any())
        else:
            self._checked(array, n_tuples * _components(array))

    def _values(self, array: Any, count: int | None) -> NDArray[Any]:
        """Return the values of an array of whole numbers."""
        _require(array.get("type") in ("Int32", "Int64", "String") and _components(array) == 1)
        _require(count is None or _whole(array.get("NumberOfTuples", str(count))) == count)
        held = self._checked(array, count)
        if isinstance(held, np.ndarray):
            return held
        data = b"".join(zlib.decompress(piece) for piece in held) if self.packed else b"".join(map(bytes, held))
        out = np.frombuffer(data, _TYPES[array.attrib["type"]])
        _require(count in (None, len(out)))
        return out

    def _checked(self, array: Any, count: int | None) -> NDArray[Any] | list[Any]:
        """Return the numbers of text, or the blocks of bytes, having checked that there are as many as needed."""
        for key in array:  # what else it holds: its range, as two numbers
            numbers = [(each.tag, each.get("index")) for each in key]
            _require(key.tag == "InformationKey" and key.get("name") in _RANGES and key.get("length") == "2")
            _require(numbers == [("Value", "0"), ("Value", "1")])
        dtype = np.dtype(_TYPES[array.attrib["type"]])
        _require(count is None or 0 <= count < _LARGEST)
        form = array.get("format")
        if form == "ascii":
            return _numbers(array.text or "", count, dtype)
        size = None if count is None else count * dtype.itemsize
        if form == "appended":
            at = _whole(array.attrib["offset"])
            _require(at < len(self.appended))
            return list(self._blocks(self.appended[at:], size))
        _require(form == "binary")
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
            _require(stored <= len(data) - width and size in (None, stored))
            yield data[width : width + stored]
            return
        blocks, each, last = np.frombuffer(data, self.word, 3).tolist()
        sizes = np.frombuffer(data, self.word, blocks, 3 * width).tolist()
        whole = blocks * each if not last else max(blocks - 1, 0) * each + last
        at = (3 + blocks) * width
        _require(
            size in (None, whole) and last <= each and sum(sizes) <= len(data) - at and whole <= _PACKING * sum(sizes)
        )
        for stored in sizes:
            yield data[at : at + stored]
            at += stored


def _grid(dataset: Any, piece: Any) -> tuple[int, int]:
    """Check the place of an image; return the numbers of points and of cells."""
    extent = np.array([int(word) for word in piece.attrib["Extent"].split()])
    _require(piece.attrib["Extent"].split() == dataset.attrib["WholeExtent"].split() and len(extent) == 6)
    for name, count in (("Origin", 3), ("Spacing", 3), ("Direction", 9)):
        if name in dataset.attrib:
            _require(bool(np.isfinite(_numbers(dataset.attrib[name], count, np.dtype("f8"))).all()))
    n, m, k = (extent[1::2] - extent[::2]).tolist()
    _require(min(n, m, k) >= 0 and np.abs(extent).max() <= 1 << 20)
    return (n + 1) * (m + 1) * (k + 1), max(n, 1) * max(m, 1) * max(k, 1)


def _numbers(text: str, count: int | None, dtype: np.dtype[Any]) -> NDArray[Any]:
    words = text.split()
    _require(count in (None, len(words)) and _NUMBER.fullmatch(text) is not None)
    _require(max(map(len, words), default=0) <= 40)
    out = np.array(words, dtype="U40").astype("f8" if dtype.kind == "f" else "i8")
    limits = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
    _require(bool(((out >= limits.min) & (out <= limits.max)).all()))
    return out


def _components(array: Any) -> int:
    out = _whole(array.get("NumberOfComponents", "1"))
    _require(0 < out <= 1000)
    return out


def _whole(word: str) -> int:
    _require(re.fullmatch(r"\d{1,18}", word, re.ASCII) is not None)
    return int(word)
