"""Read point clouds from PCD files: text, binary and compressed."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.data.points import PointCloud, cloud_of_file

_KINDS = {"F": "f", "I": "i", "U": "u"}


def read_pcd(path: Path) -> PointCloud:
    """Read a PCD file with any of the three encodings (ascii, binary, binary_compressed).

    Points without depth (NaN) are dropped and counted. Coordinates stay in the sensor frame: VIEWPOINT is not applied.
    Normals are read from normal_x, normal_y, normal_z.

    Raises
    ------
    OSError
        The file is damaged or truncated.

    Warns
    -----
    SimplexMeshWarning
        Points were dropped.
    """
    content = path.read_bytes()
    header, body = _header(path.name, content)
    try:
        dtype, count = _record_type(header)
    except (KeyError, ValueError, IndexError, TypeError):
        raise OSError(f"{path.name} is a PCD file with a damaged header") from None
    storage = header["DATA"][0].lower()
    columns = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}.get(storage)
    if columns is None:
        raise OSError(f"{path.name} must have DATA ascii, binary or binary_compressed, not {storage}")
    table = columns(path.name, body, dtype, count)
    if not {"x", "y", "z"} <= table.keys():
        raise OSError(f"{path.name} must have fields x, y and z, not {list(table)}")
    return _cloud(path.name, table)


def _cloud(name: str, table: dict[str, NDArray[Any]]) -> PointCloud:
    points = np.stack([table[c] for c in "xyz"], axis=1).astype(np.float64)
    normals = None
    if {"normal_x", "normal_y", "normal_z"} <= table.keys():
        normals = np.stack([table[f"normal_{c}"] for c in "xyz"], axis=1).astype(np.float64)
    return cloud_of_file(name, points, normals, missing=True)


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
        fields.append((unique, f"<{_KINDS[kind]}{int(size)}", (repeat,) if repeat > 1 else ()))
    if "POINTS" in header:
        return np.dtype(fields), int(header["POINTS"][0])
    return np.dtype(fields), int(header["WIDTH"][0]) * int(header["HEIGHT"][0])


def _ascii(name: str, body: bytes, dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            numbers = np.fromstring(body, sep=" ")
        except (DeprecationWarning, ValueError):
            raise OSError(f"{name} is a text PCD file with non-numeric data") from None
    widths = [int(np.prod(dtype[field].shape)) for field in dtype.names or ()]
    _check_length(name, numbers.size, count * sum(widths), "numbers")
    rows = numbers[: count * sum(widths)].reshape(count, -1)
    starts = np.cumsum(widths) - widths
    return {field: rows[:, start] for field, start in zip(dtype.names or (), starts, strict=True)}


def _binary(name: str, body: bytes, dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    _check_length(name, len(body), count * dtype.itemsize, "bytes")
    rows = np.frombuffer(body, dtype, count)
    return {field: rows[field] for field in dtype.names or ()}


def _compressed(name: str, body: bytes, dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    from simplexmesh.data._kernels import lzf_decompressed

    _check_length(name, len(body), 8, "bytes")
    packed, size = (int(n) for n in np.frombuffer(body, "<u4", 2))
    _check_length(name, len(body) - 8, packed, "compressed bytes")
    if size != count * dtype.itemsize:
        raise OSError(f"{name} must decompress to {count * dtype.itemsize:,} bytes, its header says {size:,}")
    flat, written = lzf_decompressed(np.frombuffer(body, np.uint8, packed, 8), size)
    if written != size:
        raise OSError(f"{name} has damaged compressed points")
    table = {}
    at = 0
    for field in dtype.names or ():
        kind = dtype[field]
        table[field] = np.frombuffer(flat.data, kind, count, at)
        at += count * kind.itemsize
    return table


def _check_length(name: str, have: int, wanted: int, what: str) -> None:
    if have < wanted:
        raise OSError(f"{name} must have {wanted:,} {what} of points, it has {have:,}: truncated")
