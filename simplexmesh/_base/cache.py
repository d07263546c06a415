"""The folder of numba's compiled kernels."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def ensure() -> None:
    """Set NUMBA_CACHE_DIR to a private folder if neither package nor user's cache is writable, as in containers."""
    if os.environ.get("NUMBA_CACHE_DIR") or _writable(_user_folder()):
        return
    folders = (folder for folder in Path(__file__).parents[1].rglob("*") if any(folder.glob("_kernels*.py")))
    if all(_writable(folder / "__pycache__") for folder in folders):
        return
    import tempfile

    user = os.getuid() if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
    folder = Path(tempfile.gettempdir(), f"simplexmesh-numba-{user}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        owned = not hasattr(os, "getuid") or (folder.stat().st_uid == user and not folder.is_symlink())
        if not owned or not _writable(folder):  # another user's: its compiled code must not be loaded
            folder = Path(tempfile.mkdtemp(prefix="simplexmesh-numba-"))
    except OSError:
        return
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:  # it has already read its environment
        sys.modules["numba"].config.CACHE_DIR = str(folder)


def _user_folder() -> Path:
    """Return the user's cache folder as numba defines it (numba.misc.appdirs)."""
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"), "numba")
    if sys.platform == "darwin":
        return Path(os.path.expanduser("~/Library/Caches"), "numba")
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "numba")


def _writable(folder: Path) -> bool:
    """Whether files can be written to the folder, or to the one it would be created in."""
    try:
        while not folder.exists():
            if folder == folder.parent:
                return False
            folder = folder.parent
    except OSError:  # no permission to search a parent folder
        return False
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)
