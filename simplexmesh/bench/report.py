"""The folder of a report, written atomically."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TITLE = "# Estimators of normals and curvatures compared"
"""First line of every report, by which folders that may be replaced are recognized."""

INDEX = "index.md"

FILES = re.compile(
    r"index\.md|\.DS_Store|(border|meshes|noise|pointwise|spread|tilts|tori|ratings_\w+)\.csv"
    r"|(map|meshes|pointwise)_\w+\.png"
)
"""Names of the files of a report; a folder with others is not replaced."""


def writable(path: str | Path) -> Path:
    """Return the folder to write, or refuse what is not a new one, empty, or an earlier report without other files."""
    folder = Path(path).expanduser().absolute()
    if not folder.parent.is_dir():
        raise FileNotFoundError(f"--output must be in an existing folder, {str(folder.parent)!r} is not one")
    if not os.access(folder.parent, os.W_OK):
        raise PermissionError(f"--output must be in a folder that can be written to, {str(folder.parent)!r} cannot")
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise NotADirectoryError(f"--output must be a folder, {str(path)!r} is a file or a link")
    inside = sorted(folder.iterdir()) if folder.exists() else []
    wanted = "--output must be a new folder or an earlier report"
    if inside and not _is_report(folder):
        raise FileExistsError(f"{wanted}, {str(path)!r} is a folder of something else")
    if others := [each.name for each in inside if not (each.is_file() and FILES.fullmatch(each.name))]:
        raise FileExistsError(f"{wanted} and nothing else, {str(path)!r} also has {others[0]!r}")
    return folder


def _is_report(folder: Path) -> bool:
    try:
        with (folder / INDEX).open(encoding="utf-8") as lines:
            return lines.readline().rstrip("\n") == TITLE
    except (OSError, UnicodeDecodeError):
        return False


@contextmanager
def draft_of(folder: Path) -> Iterator[Path]:
    """Yield an empty folder that replaces `folder` at the end, or is removed on any error."""
    draft, older = (folder.with_name(f".{folder.name}.{os.getpid()}.{end}") for end in ("part", "older"))
    try:
        draft.mkdir()  # in here, as a Ctrl-C may come right after it
        yield draft
        if folder.exists():
            os.replace(folder, older)
        os.replace(draft, folder)
    except BaseException:
        if older.exists() and not folder.exists():
            os.replace(older, folder)
        raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)
        shutil.rmtree(older, ignore_errors=True)
