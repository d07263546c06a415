"""What LAS and E57 have in common: tables with a column for each number of a point, and libraries that are optional."""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.arrays import Array

Columns = dict[str, NDArray[Any]]
Parts = tuple[Array, Array | None, Mapping[str, NDArray[Any]], str | None]
"""Points, NaN if not measured, normals, named arrays and unit."""

PIECE = 1_000_000
"""Points converted at once, so that little more room is needed than the cloud takes."""

SURVEY = "the extra survey: pip install 'simplexmesh[survey]'"


_SILENT = logging.NullHandler()
"""Of what laspy says of damaged files beside its errors."""


class Table(dict[str, NDArray[Any]]):
    """Columns of a known number of rows, filled piece by piece."""

    def __init__(self, n: int) -> None:
        super().__init__()
        self.n = n

    def put(self, name: str, at: int, values: NDArray[Any]) -> None:
        """Set the rows of a column from `at` on; numbers of a wider type make it wider."""
        if name not in self:
            self[name] = np.empty((self.n, *values.shape[1:]), values.dtype)
        kind = np.result_type(self[name], values)
        if kind != self[name].dtype:
            self[name] = self[name].astype(kind)
        self[name][at : at + len(values)] = values


def columns_of(data: Mapping[str, NDArray[Any]]) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield named arrays as columns in native types of one to eight bytes, those of one array as `name.0`, `name.1`."""
    for name, values in data.items():
        plain = re.sub(r"\.(?=\d+$)", "_", name)
        if values.ndim == 1:
            yield plain, _simple(values)
            continue
        for i, column in enumerate(values.reshape(len(values), -1).T):
            yield f"{plain}.{i}", _simple(column)


def arrays_of(columns: Columns) -> Columns:
    """Return columns as the named arrays that `columns_of` makes them of."""
    out = {name: column for name, column in columns.items() if not re.search(r"\.\d+$", name)}
    for name in columns:
        whole, _, number = name.rpartition(".")
        if number == "0" and whole not in out:
            parts = [f"{whole}.{i}" for i in range(len(columns)) if f"{whole}.{i}" in columns]
            out[whole] = np.stack([columns[part] for part in parts], axis=1)
    return out


def _simple(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    wider = {2: np.float32, 12: np.float64, 16: np.float64} if values.dtype.kind == "f" else {}
    return values.astype(wider.get(values.dtype.itemsize, values.dtype.newbyteorder("=")), copy=False)


def parts_of(points: Array, normals: Array | None, columns: Columns, unit: str | None) -> Parts:
    """Return what was read read-only, of which a cloud needs no copy."""
    data = arrays_of(columns)
    for values in (points, *data.values()):
        values.setflags(write=False)
    return points, normals, MappingProxyType(data), unit


@contextmanager
def complaints(sentence: str) -> Iterator[None]:
    """Say in one sentence what libraries raise, of which not all errors are exceptions."""
    try:
        yield
    except (OSError, KeyboardInterrupt, SystemExit, GeneratorExit):
        raise
    except BaseException as error:  # lazrs panics with a class that is no Exception
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise OSError(f"{sentence}: {reason[:150]}") from None


@contextmanager
def needed() -> Iterator[None]:
    """Say how a missing library is installed, and nothing of what it warns of when it is imported."""
    logging.getLogger("laspy").addHandler(_SILENT)
    try:
        with warnings.catch_warnings(action="ignore"):
            yield
    except ImportError as error:
        raise ImportError(f"this needs {SURVEY}") from error
