"""Writing of files by drafts, so that a file is complete or as it was, also after an interrupt or a power failure."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

_DRAFT = re.compile(r"\.part-[0-9a-f]{16}\.")
_DAY = 86400.0


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
    ending = os.fsencode(target.name.lower())[-200:].decode(errors="ignore")  # ITK knows no formats in capitals
    part = target.with_name(f".part-{secrets.token_hex(8)}.{ending}")
    lock = -1
    try:
        _sweep(target.parent, ending)
        lock = _created(part)
        yield part
        _flush(part)
        if target.exists():
            shutil.copymode(target, part)
        os.replace(part, target)
    except OSError as problem:
        if problem.strerror and str(problem.filename) == str(part):  # name the file that was asked for
            raise OSError(problem.errno, problem.strerror, str(path)) from problem
        raise
    finally:
        if lock >= 0:
            os.close(lock)
        part.unlink(missing_ok=True)


def _created(part: Path) -> int:
    """Create a draft, which must not exist, and return what holds its lock as long as this process lives."""
    handle = os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_NOFOLLOW", 0), 0o666)
    if fcntl is None:
        os.close(handle)  # an open file could not be replaced
        return -1
    with contextlib.suppress(OSError):  # not all network drives have locks
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return handle


def _flush(part: Path) -> None:
    """Wait until a draft is on disk, as the renaming may be earlier than its content."""
    with part.open("rb+") as file:
        os.fsync(file.fileno())
        if not file.seek(0, os.SEEK_END):
            raise OSError("nothing was written")


def _sweep(folder: Path, ending: str) -> None:
    """Remove the drafts of a file whose processes were killed: their locks are free."""
    names: list[Path] = []
    with contextlib.suppress(OSError):  # a folder may be written to but not listed
        names = list(folder.iterdir())
    for old in names:
        mark = _DRAFT.match(old.name)
        if mark is None or old.name[mark.end() :] != ending or old.is_symlink():
            continue
        with contextlib.suppress(OSError):  # of somebody else, or removed in the meantime
            if _is_abandoned(old):
                old.unlink()


def _is_abandoned(old: Path) -> bool:
    if fcntl is None:
        return time.time() - old.stat().st_mtime > _DAY
    handle = os.open(old, os.O_RDWR | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return os.fstat(handle).st_mtime < time.time() - 1  # a younger one may be about to be locked
    finally:
        os.close(handle)
