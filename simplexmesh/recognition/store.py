"""Models in one file: an SQLite database with a rollback journal.

Why this store: it is in Python's standard library, one file, and a change is either whole or not there, whatever
happens in the middle. Why a rollback journal and not a write-ahead log: at rest there is nothing beside the file, so
it can be copied, sent, and read from folders that cannot be written to and from network drives; what the log would
gain, writing while others read, matters little where a change takes milliseconds. Each operation opens the file for
itself, so a store can be shared by threads and processes, and nothing needs to be closed.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import sqlite3

KIND, VERSION = 0x534D4C31, 1
"""What marks a file as one of ours ("SML1"), and which way it is laid out."""

PATIENCE = 60.0
"""Seconds to wait while others write."""

IDENTITY = "(id << 32 | checked)"
"""What tells data from any other: its number and its checksum, since copies of a file go on counting from the same."""

TABLES = (
    "CREATE TABLE library (changes INTEGER NOT NULL, made BLOB NOT NULL)",
    "INSERT INTO library VALUES (0, randomblob(16))",
    "CREATE TABLE models (id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, data BLOB NOT NULL, "
    "checked INTEGER NOT NULL)",
)


class Store:
    """Named pieces of data in a file.

    Parameters
    ----------
    path : Path
        Made with the first piece.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def put(self, name: str, data: bytes, *, replace: bool) -> bool:
        """Add a piece, on disk when this returns; return False, and change nothing, if the name is taken."""
        with self._opened(create=True) as file:
            file.execute("BEGIN IMMEDIATE")
            if replace:
                file.execute("DELETE FROM models WHERE name = ?", (name,))
            elif file.execute("SELECT 1 FROM models WHERE name = ?", (name,)).fetchone():
                file.execute("ROLLBACK")
                return False
            file.execute("INSERT INTO models (name, data, checked) VALUES (?, ?, ?)", (name, data, zlib.crc32(data)))
            self._changed(file)
        return True

    def remove(self, name: str) -> bool:
        """Remove a piece; return False if there is none of that name."""
        if not self.path.exists():
            return False
        with self._opened() as file:
            file.execute("BEGIN IMMEDIATE")
            if not file.execute("DELETE FROM models WHERE name = ?", (name,)).rowcount:
                file.execute("ROLLBACK")
                return False
            self._changed(file)
        return True

    def exists(self) -> bool:
        """Whether there is anything; a crash while the file is made leaves it empty."""
        return self.path.exists() and (self.path.is_dir() or self.path.stat().st_size > 0)

    def names(self) -> list[str]:
        """Return all names, in the order in which they were added; none if there is no file, or nothing in it yet."""
        if not self.exists():
            return []
        with self._opened() as file:
            return [name for (name,) in file.execute("SELECT name FROM models ORDER BY id")]

    def stamp(self) -> bytes:
        """Return what no other state of this file, or of another, has."""
        with self._opened() as file:
            return self._stamp(file)

    def read(self, known: set[int]) -> tuple[bytes, list[tuple[int, str]], dict[int, bytes]]:
        """Return the stamp, all identities and names in the order they were added, and the data of those not known."""
        with self._opened() as file:
            file.execute("BEGIN")
            stamp = self._stamp(file)
            names = file.execute(f"SELECT {IDENTITY}, name FROM models ORDER BY id").fetchall()
            data = {}
            for number, name in names:
                if number not in known:
                    (data[number],) = file.execute("SELECT data FROM models WHERE id = ?", (number >> 32,)).fetchone()
                    if zlib.crc32(data[number]) != number & 0xFFFFFFFF:
                        raise OSError(f"{self.path} is damaged: the data of {name!r} is not what was written")
        return stamp, names, data

    @staticmethod
    def _stamp(file: sqlite3.Connection) -> bytes:
        return bytes(_one(file, "SELECT CAST(made AS BLOB) FROM library"))

    @staticmethod
    def _changed(file: sqlite3.Connection) -> None:
        file.execute("UPDATE library SET changes = changes + 1, made = randomblob(16)")
        file.execute("COMMIT")

    @contextmanager
    def _opened(self, *, create: bool = False) -> Iterator[sqlite3.Connection]:
        """Lend a connection; what goes wrong with it is told in one sentence.

        Raises
        ------
        OSError
        """
        import sqlite3

        if self.path.is_dir():
            raise IsADirectoryError(f"{self.path} is a folder, not a model library")
        if not self.path.exists() and not create:
            raise FileNotFoundError(f"there is no model library {self.path}")
        if not self.path.parent.is_dir():
            raise FileNotFoundError(f"there is no folder {self.path.parent} to write {self.path.name} to")
        try:
            mode = "rwc" if create else "rw" if self._writable() else "ro"
            place = f"{address(self.path.absolute())}?mode={mode}"
            file = sqlite3.connect(place, timeout=PATIENCE, isolation_level=None, uri=True)
            try:
                self._understand(file, create=create)
                yield file
            finally:
                file.close()
        except (sqlite3.Error, TypeError) as problem:
            raise _told(self.path, problem) from None

    def _writable(self) -> bool:
        return os.access(self.path, os.W_OK) and os.access(self.path.parent, os.W_OK)

    def _understand(self, file: sqlite3.Connection, *, create: bool) -> None:
        """Make the tables of a new file; find out whether another is one of ours.

        Raises
        ------
        OSError
        """
        if _one(file, "PRAGMA schema_version") == 0 and create:  # which also puts right what a crash left
            file.execute("BEGIN IMMEDIATE")
            if _one(file, "PRAGMA schema_version") == 0:  # nobody else made it in the meantime
                for line in (f"PRAGMA application_id = {KIND}", f"PRAGMA user_version = {VERSION}", *TABLES):
                    file.execute(line)
            file.execute("COMMIT")
        if _one(file, "PRAGMA page_count") == 0:
            raise OSError(f"{self.path} is empty, not a model library")
        if _one(file, "PRAGMA application_id") != KIND:
            raise OSError(f"{self.path} is a database of another program, not a model library")
        version = _one(file, "PRAGMA user_version")
        if version != VERSION:
            raise OSError(f"{self.path} is laid out as version {version} of model libraries; only {VERSION} is known")


def _one(file: sqlite3.Connection, question: str) -> Any:
    return file.execute(question).fetchone()[0]


def address(path: PurePath) -> str:
    """Return a path as SQLite reads it: network folders of Windows go without a host.

    Examples
    --------
    >>> from pathlib import PurePosixPath, PureWindowsPath
    >>> address(PurePosixPath("/data/a b/x.sml")), address(PureWindowsPath("C:/x.sml"))
    ('file:///data/a%20b/x.sml', 'file:///C:/x.sml')
    >>> address(PureWindowsPath("//server/share/x.sml"))
    'file:////server/share/x.sml'
    """
    told = path.as_uri()
    return told if told.startswith("file:///") else told.replace("file://", "file:////", 1)


def _told(path: Path, problem: Exception) -> OSError:
    """Return what went wrong with a file, as the operating system would tell it."""
    said = str(problem)
    if "locked" in said or "readonly" in said or "full" in said or "unable to open" in said:
        return OSError(f"{path} cannot be used now: {said}")
    return OSError(f"{path} is not a whole model library: {said}")
