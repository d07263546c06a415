"""Where compiled kernels and tables are kept: numba's folder when its own are closed, and the one of tables."""

from __future__ import annotations

import os
import sys
from pathlib import Path

ROOMS = ("mesh", "data", "motion", "recognition", "surface")


def ensure() -> None:
    """Name a folder of the user's own in NUMBA_CACHE_DIR, if numba would find none and stop; before its first import.

    Containers and build machines have packages that only root may write, and no home. Numba is content with the
    package's `__pycache__` or the user's cache folder; only where both are closed is anything changed.
    """
    if os.environ.get("NUMBA_CACHE_DIR") or _writable(_user_folder()):
        return
    if all(_writable(Path(__file__).parent / room / "__pycache__") for room in ROOMS):
        return
    import tempfile

    folder = Path(tempfile.gettempdir(), f"simplexmesh-numba-{_user()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        owned = not hasattr(os, "getuid") or (folder.stat().st_uid == os.getuid() and not folder.is_symlink())
        if not owned or not _writable(folder):  # somebody else's: code from there must not run
            folder = Path(tempfile.mkdtemp(prefix="simplexmesh-numba-"))
    except OSError:
        return
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:  # it has read its environment already
        sys.modules["numba"].config.CACHE_DIR = str(folder)


def _user() -> str:
    return str(os.getuid()) if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")


def _user_folder() -> Path:
    """Return the folder numba takes for the user's (numba.misc.appdirs)."""
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"), "numba")
    if sys.platform == "darwin":
        return Path(os.path.expanduser("~/Library/Caches"), "numba")
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "numba")


def _writable(folder: Path) -> bool:
    """Whether files can be written in the folder, or it can be made."""
    try:
        while not folder.exists():
            if folder == folder.parent:
                return False
            folder = folder.parent
    except OSError:  # a folder above must not even be searched
        return False
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def tables() -> Path | None:
    """Return the folder for tables that are computed once and shared by processes, or None where none can be written.

    The environment variable SIMPLEXMESH_CACHE names another one.

    Examples
    --------
    >>> tables() is None or tables().name != ""
    True
    """
    named = os.environ.get("SIMPLEXMESH_CACHE")
    folder = Path(named) if named else _user_folder().with_name("simplexmesh")
    return folder if _writable(folder) else None
