"""Read point clouds from PCD files: text, binary and compressed; none of the libraries here reads them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array
from simplexmesh.data import columns
from simplexmesh.data.points import PointCloud, cloud_of_file

_MOST_REPEATED = 1 << 16
"""Largest number of values in a field of a point: a signature of its neighborhood has some hundred."""

_MOST_PACKED = 90
"""LZF packs equal bytes to a ninetieth: 264 into three."""

_KINDS = {"F": "f", "I": "i", "U": "u"}


def read_pcd(path: Path) -> PointCloud:
    """Read a PCD file; points without depth are left out and counted, and VIEWPOINT is not applied."""
    content = path.read_bytes()
    header, body = _header(path.name, content)
    try:
        dtype, count = _record_type(header)
    except (KeyError, ValueError, IndexError, TypeError):
        raise OSError(f"{path.name} is a PCD file with a damaged header") from None
    if not count:
        raise OSError(f"{path.name} must have points, its header says 0")
    storage = header["DATA"][0].lower()
    read = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}.get(storage)
    if read is None:
        raise OSError(f"{path.name} must have DATA ascii, binary or binary_compressed, not {storage}")
    table = read(path.name, body, dtype, count)
    if not {"x", "y", "z"} <= table.keys():
        raise OSError(f"{path.name} must have fields x, y and z, not {list(table)}")
    named = {name: column for name, column in table.items() if not name.startswith("_")}  # the rest is padding
    points, normals = columns.points_of(named), columns.normals_of(named)
    return cloud_of_file(path.name, points, normals, columns.data_of(named), missing=True)


def _header(name: str, content: bytes) -> tuple[dict[str, list[str]], bytes]:
    header: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in header:
        end = content.find(b"\n", at)
        if end < 0 or len(header) > 20:
            raise OSError(f"{name} is a PCD file without DATA line: truncated")
        words = content[at:end].decode("latin-1").split("#")[0].split()
        at = end + 1
        if words:
            header[words[0].upper()] = words[1:]
    if not header["DATA"]:
        raise OSError(f"{name} is a PCD file with a damaged header")
    return header, content[at:]


def _record_type(header: dict[str, list[str]]) -> tuple[np.dtype[Any], int]:
    counts = [int(c) for c in header.get("COUNT", ["1"] * len(header["FIELDS"]))]
    fields = []
    for i, (name, kind, size, repeat) in enumerate(
        zip(header["FIELDS"], header["TYPE"], header["SIZE"], counts, strict=True)
    ):
        unique = f"_{i}" if name == "_" else name
        if not 0 < repeat <= _MOST_REPEATED:
            raise ValueError("a field must have a positive count")
        fields.append((unique, f"<{_KINDS[kind]}{int(size)}", (repeat,) if repeat > 1 else ()))
    count = int(header["POINTS"][0]) if "POINTS" in header else int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
    if count < 0:
        raise ValueError("the number of points must be positive")
    return np.dtype(fields), count


def _ascii(name: str, body: bytes, dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    widths = [int(np.prod(dtype[field].shape)) for field in dtype.names or ()]
    try:
        numbers = np.array(body.split(), dtype=np.float64)
    except ValueError:
        raise OSError(f"{name} is a text PCD file with non-numeric data") from None
    _check_length(name, numbers.size, count * sum(widths), "numbers")
    rows = numbers[: count * sum(widths)].reshape(count, -1)
    pieces = np.split(rows, np.cumsum(widths)[:-1], axis=1)
    names = dtype.names or ()
    return {name: _typed(name, piece, dtype[name]) for name, piece in zip(names, pieces, strict=True)}


def _typed(name: str, piece: Array, kind: np.dtype[Any]) -> NDArray[Any]:
    """Return the numbers of a field with the type of the header if that is of whole numbers or packed colors."""
    out = piece.reshape(len(piece), *kind.shape)
    if kind.base.kind == "f" and name not in ("rgb", "rgba"):
        return out
    with np.errstate(invalid="ignore"):
        typed = out.astype(kind.base)
    return typed if kind.base.kind == "f" or np.array_equal(typed, out) else out


def _binary(name: str, body: bytes, dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    _check_length(name, len(body), count * dtype.itemsize, "bytes")
    rows = np.frombuffer(body, dtype, count)
    return {field: rows[field] for field in dtype.names or ()}


def _compressed(name: str, body: bytes, dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    _check_length(name, len(body), 8, "bytes")
    packed, size = (int(n) for n in np.frombuffer(body, "<u4", 2))
    _check_length(name, len(body) - 8, packed, "compressed bytes")
    if size > _MOST_PACKED * packed:
        raise OSError(f"{name} must have more than {packed:,} compressed bytes for {size:,}: truncated or damaged")
    if size != count * dtype.itemsize:
        raise OSError(f"{name} must decompress to {count * dtype.itemsize:,} bytes, its header says {size:,}")
    flat = decompressed(body[8 : 8 + packed], size)
    if len(flat) != size:
        raise OSError(f"{name} has damaged compressed points")
    kinds = [dtype[field] for field in dtype.names or ()]
    starts = np.cumsum([0] + [count * kind.itemsize for kind in kinds])
    columns = [np.frombuffer(flat, kind, count, start) for kind, start in zip(kinds, starts.tolist(), strict=False)]
    return dict(zip(dtype.names or (), columns, strict=True))


def decompressed(packed: bytes, size: int) -> bytes:
    """Return the bytes of an LZF stream (M. Lehmann, liblzf 3.6, lzf_d.c), fewer than `size` if it is damaged.

    A control byte below 32 starts a run of control + 1 literal bytes, another one a copy of (control >> 5) + 2 bytes
    (7 adds the next byte) from a distance of ((control & 31) << 8) + the next byte + 1.
    """
    out = bytearray()
    at, end = 0, len(packed)
    while at < end and len(out) < size:
        control = packed[at]
        at += 1
        if control < 32:
            out += packed[at : at + control + 1]
            at += control + 1
            continue
        length = (control >> 5) + 2
        if length == 9 and at < end:
            length += packed[at]
            at += 1
        start = len(out) - (((control & 31) << 8) + 1 + (packed[at] if at < end else end))
        at += 1
        if start < 0 or at > end:
            return b""
        piece = out[start : start + length]
        out += (piece * (length // len(piece) + 1))[:length]  # a copy may reach into itself
    return bytes(out)


def _check_length(name: str, have: int, wanted: int, what: str) -> None:
    if have < wanted:
        raise OSError(f"{name} must have {wanted:,} {what} of points, it has {have:,}: truncated")
