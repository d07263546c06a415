"""Tables with a named column for each number of a point: what PLY, PCD and data frames hold."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array
from simplexmesh._base.named_arrays import Data

NORMALS = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"))
ALONE = "alone "
"""Before the names, in a comment of a PLY file, of columns that are arrays of their own whatever they are called."""

_COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_OPACITY = {"red": "alpha", "diffuse_red": "diffuse_alpha", "r": "a"}


def points_of(table: Data) -> Array:
    """Return the columns x, y and z as points."""
    return _stacked(table, ("x", "y", "z")).astype(np.float64)


def normals_of(table: Data) -> Array | None:
    """Return the columns of normals, None without any."""
    names = next((triple for triple in NORMALS if {*triple} <= table.keys()), None)
    return None if names is None else _stacked(table, names).astype(np.float64)


def data_of(table: Data, alone: Collection[str] = ()) -> dict[str, NDArray[Any]]:
    """Return all other numbers: colors as bytes, columns like `uv_0` and `uv_1` as one array, and the rest `alone`."""
    kept = {name: column for name, column in table.items() if name in alone}
    left = {name: column for name, column in table.items() if column.dtype.kind in "biuf" and name not in kept}
    for name in ("x", "y", "z", *(NORMALS[0] if {*NORMALS[0]} <= left.keys() else NORMALS[1])):
        left.pop(name, None)
    found: dict[str, NDArray[Any]] = {}
    names: tuple[str, ...] = next((triple for triple in _COLORS if {*triple} <= left.keys()), ())
    if names:
        names += (_OPACITY[names[0]],) if _OPACITY[names[0]] in left else ()
        found["colors"] = as_colors(_stacked(left, names))
        left = {name: column for name, column in left.items() if name not in names}
    for name in ("rgb", "rgba"):
        if name in left and "colors" not in found and left[name].dtype.itemsize == 4 and left[name].ndim == 1:
            found["colors"] = _unpacked(left.pop(name), with_opacity=name == "rgba")
    return kept | found | _gathered(left)


def as_colors(values: NDArray[Any]) -> NDArray[Any]:
    """Return colors as bytes if they are shares from 0 to 1 or bytes in wider numbers, as in tables of text."""
    if values.dtype == np.uint8:
        return values
    low, high = float(values.min(initial=0)), float(values.max(initial=0))
    if values.dtype.kind == "f" and low >= 0 and high <= 1:
        return np.rint(255 * values).astype(np.uint8)
    if values.dtype == np.uint16 and high > 255:
        return np.rint(values / 257).astype(np.uint8)
    return values.astype(np.uint8) if low >= 0 and high <= 255 and np.array_equal(values, np.rint(values)) else values


def _stacked(table: Data, names: tuple[str, ...]) -> NDArray[Any]:
    return np.stack([table[name] for name in names], axis=1)


def _unpacked(packed: NDArray[Any], *, with_opacity: bool) -> NDArray[np.uint8]:
    """Return the bytes of colors packed as 0xAARRGGBB, which PCD files also call floats; many leave opacity zero."""
    channels = np.ascontiguousarray(packed).astype(packed.dtype.newbyteorder("<"), copy=False).view(np.uint8)
    rows = channels.reshape(-1, 4)[:, [2, 1, 0, 3]]
    return rows if with_opacity and not np.isin(rows[:, 3], (0, 255)).all() else rows[:, :3]


def _gathered(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return columns numbered from 0 on as one array each."""
    runs: dict[str, list[str]] = {}
    for name in columns:
        numbered = re.fullmatch(r"(.+)_(\d+)", name)
        if numbered and int(numbered[2]) == len(runs.get(numbered[1], ())) and columns[name].ndim == 1:
            runs.setdefault(numbered[1], []).append(name)
    runs = {base: names for base, names in runs.items() if len(names) > 1 and base not in columns}
    inside = {name for names in runs.values() for name in names}
    alone = {name: column for name, column in columns.items() if name not in inside}
    return alone | {base: _stacked(columns, tuple(names)) for base, names in runs.items()}


def columns_of(data: Mapping[str, NDArray[Any]]) -> list[tuple[str, NDArray[Any]]]:
    """Return named arrays as columns that `data_of` makes the same arrays of, if no two have one name."""
    out: list[tuple[str, NDArray[Any]]] = []
    for name, values in data.items():
        if name == "colors" and values.ndim == 2 and values.shape[1] in (3, 4):
            out += zip((*_COLORS[0], "alpha"), values.T, strict=False)
        elif values.ndim == 1:
            out.append((name, values))
        else:
            out += ((f"{name}_{i}", column) for i, column in enumerate(values.reshape(len(values), -1).T))
    return out
