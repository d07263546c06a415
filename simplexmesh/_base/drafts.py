"""Writing of files by drafts, so that a file is complete or as it was, also after an interrupt."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def draft(path: Path) -> Iterator[Path]:
    """Yield a path to write to, which in the end replaces the file, or what a link points to, unless errors occur."""
    target = Path(os.path.realpath(path)) if path.is_symlink() else path
    if not target.parent.is_dir():
        raise FileNotFoundError(f"path must be in an existing folder, {str(target.parent)!r} is not one")
    if target.is_dir():
        raise IsADirectoryError(f"path must be a file, {str(path)!r} is a folder")
    if target.exists() and not target.is_file():
        raise OSError(f"path must be a regular file, {str(path)!r} is a pipe or a device")
    part = target.with_name(f".part{os.getpid()}.{target.name.lower()}")  # ITK knows no formats in capitals
    try:
        yield part
        if target.exists():
            shutil.copymode(target, part)
        os.replace(part, target)
    except OSError as problem:
        if problem.strerror and str(problem.filename) == str(part):  # name the file that was asked for
            raise OSError(problem.errno, problem.strerror, str(path)) from problem
        raise
    finally:
        part.unlink(missing_ok=True)
