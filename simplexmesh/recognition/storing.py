"""Signatures in files."""

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

KIND = "simplexmesh SAI 1"

DAMAGE = (
    *(ValueError, TypeError, KeyError, IndexError, AttributeError, EOFError, OSError, MemoryError),
    *(NotImplementedError, OverflowError, zipfile.BadZipFile, zlib.error),
)
"""What reading a damaged file may raise."""


def write(path: str | os.PathLike[str], **parts: NDArray[Any]) -> None:
    """Write a signature's parts to a file, by a temporary name beside it.

    Raises
    ------
    OSError
        The folder does not exist or cannot be written to.
    """
    place = _path(path)
    if not place.parent.is_dir():
        raise FileNotFoundError(f"there is no folder {place.parent} to write {place.name} to")
    draft = place.with_name(f".{place.name}.{os.getpid()}.part")
    try:
        with draft.open("wb") as file:
            np.savez_compressed(file, kind=np.array(KIND), **parts)  # type: ignore[arg-type]
        os.replace(draft, place)
    finally:
        draft.unlink(missing_ok=True)


@contextmanager
def understood(path: str | os.PathLike[str]) -> Iterator[Mapping[str, NDArray[Any]]]:
    """Lend the parts of a signature's file; what goes wrong with them is the file's fault.

    Raises
    ------
    OSError
        The file is absent, not one of ours, or cut short.
    """
    place = _path(path)
    if not place.is_file():
        raise FileNotFoundError(f"there is no file {place}")
    try:
        with place.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            if str(file["kind"]) != KIND:
                raise ValueError(f"it is of kind {str(file['kind'])[:40]!r}")
            yield {name: file[name] for name in file.files}
    except DAMAGE as problem:
        raise OSError(f"{place} is not a whole signature written by SAI.save: {problem}") from None


def _path(path: str | os.PathLike[str]) -> Path:
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be the name of a file, not {type(path).__name__}")
    return Path(path)
