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
    """Return the folder to write, checked: new, empty, or an earlier report.

    Raises
    ------
    OSError
        A file, a folder of something else or with other files, or no write permission.

    Examples
    --------
    >>> writable("report").name
    'report'
    """
    folder = Path(path).expanduser().absolute()
    if not folder.parent.is_dir():
        raise FileNotFoundError(f"--output must be in an existing folder, {str(folder.parent)!r} is not one")
    if not os.access(folder.parent, os.W_OK):
        raise PermissionError(f"--output must be in a folder that can be written to, {str(folder.parent)!r} cannot")
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise NotADirectoryError(f"--output must be a folder, {str(path)!r} is a file or a link")
    if folder.exists() and any(folder.iterdir()) and not _is_report(folder):
        raise FileExistsError(
            f"--output must be a new folder or an earlier report, {str(path)!r} is a folder of something else"
        )
    if folder.exists() and (others := sorted(each.name for each in folder.iterdir() if not _is_reported(each))):
        raise FileExistsError(
            f"--output must be a new folder or an earlier report and nothing else, {str(path)!r} also has {others[0]!r}"
        )
    return folder


def _is_reported(path: Path) -> bool:
    return path.is_file() and FILES.fullmatch(path.name) is not None


def _is_report(folder: Path) -> bool:
    index = folder / INDEX
    try:
        with index.open(encoding="utf-8") as lines:
            return lines.readline().rstrip("\n") == TITLE
    except (OSError, UnicodeDecodeError):
        return False


@contextmanager
def draft_of(folder: Path) -> Iterator[Path]:
    """Yield an empty folder that replaces `folder` at the end, or is removed on any error.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as place:
    ...     with draft_of(Path(place) / "report") as draft:
    ...         _ = (draft / "index.md").write_text(TITLE)
    ...     sorted(path.name for path in Path(place).rglob("*"))
    ['index.md', 'report']
    """
    draft = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    older = folder.with_name(f".{folder.name}.{os.getpid()}.older")
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
