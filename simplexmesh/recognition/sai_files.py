"""Reading and writing files of signatures."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh._draft import draft

KIND = "simplexmesh SAI 1"

DAMAGE = (
    *(ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OSError, MemoryError),
    *(NotImplementedError, OverflowError, zipfile.BadZipFile, zlib.error),
)
"""Exceptions that reading a damaged file may raise."""


def write(path: str | os.PathLike[str], **parts: NDArray[Any]) -> None:
    """Write the arrays of a signature to a file, replaced atomically.

    Raises
    ------
    OSError
        The folder does not exist or cannot be written to.
    """
    with draft(_path(path)) as part, part.open("wb") as file:
        np.savez_compressed(file, kind=np.array(KIND), **parts)  # type: ignore[arg-type]


@contextmanager
def read(path: str | os.PathLike[str]) -> Iterator[Mapping[str, NDArray[Any]]]:
    """Yield the arrays of a signature file; exceptions raised while they are used count as damage of the file.

    Raises
    ------
    OSError
        The file is missing, of another kind or truncated.
    """
    target = _path(path)
    if not target.is_file():
        raise FileNotFoundError(f"there is no file {target}")
    try:
        with target.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            if str(file["kind"]) != KIND:
                raise ValueError(f"it is of kind {str(file['kind'])[:40]!r}")
            yield {name: file[name] for name in file.files}
    except DAMAGE as error:
        raise OSError(f"{target} is not a whole signature written by SAI.save: {error}") from None


def _path(path: str | os.PathLike[str]) -> Path:
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be the name of a file, not {type(path).__name__}")
    return Path(path)
