"""The folder of a report, written atomically."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

INDEX = "index.md"


def writable(path: str | Path) -> Path:
    """Return the folder to write, or refuse what is not a new one."""
    folder = Path(path).expanduser().absolute()
    if not folder.parent.is_dir():
        raise FileNotFoundError(f"--output must be in an existing folder, {str(folder.parent)!r} is not one")
    if not os.access(folder.parent, os.W_OK):
        raise PermissionError(f"--output must be in a folder that can be written to, {str(folder.parent)!r} cannot")
    if folder.exists() or folder.is_symlink():
        raise FileExistsError(f"--output must be a new folder, {str(path)!r} is there already")
    return folder


@contextmanager
def draft_of(folder: Path) -> Iterator[Path]:
    """Yield an empty folder that becomes `folder` at the end, or is removed on any error."""
    draft = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    try:
        draft.mkdir()  # in here, as a Ctrl-C may come right after it
        yield draft
        draft.rename(folder)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
