"""Models in one file: an SQLite database with a rollback journal.

A rollback journal, unlike a write-ahead log, leaves no other files at rest: the file can be copied and read from
read-only folders. Each operation opens its own connection, so threads and processes can share a store.
"""

from __future__ import annotations

import os
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import sqlite3

APPLICATION_ID, VERSION = 0x534D4C31, 1
"""Application id ("SML1") and format version of the file."""

TIMEOUT = 60.0
"""Seconds to wait for a lock."""

IDENTITY = "(id << 32 | checked)"
"""Identity of an entry: id and checksum, since copies of a file reuse ids."""

TABLES = (
    "CREATE TABLE library (changes INTEGER NOT NULL, made BLOB NOT NULL)",
    "INSERT INTO library VALUES (0, randomblob(16))",
    "CREATE TABLE models (id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, data BLOB NOT NULL, "
    "checked INTEGER NOT NULL)",
)


class Store:
    """Named entries of bytes in a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def put(self, name: str, data: bytes, *, replace: bool) -> bool:
        """Add an entry, on disk when this returns; return False without a change if the name exists."""
        with self._opened(create=True) as file:
            file.execute("BEGIN IMMEDIATE")
            if replace:
                file.execute("DELETE FROM models WHERE name = ?", (name,))
            elif file.execute("SELECT 1 FROM models WHERE name = ?", (name,)).fetchone():
                file.execute("ROLLBACK")
                return False
            file.execute("INSERT INTO models (name, data, checked) VALUES (?, ?, ?)", (name, data, zlib.crc32(data)))
            self._commit(file)
        return True

    def remove(self, name: str) -> bool:
        """Remove an entry; return False if there is none of that name."""
        if not self.path.exists():
            return False
        with self._opened() as file:
            file.execute("BEGIN IMMEDIATE")
            if not file.execute("DELETE FROM models WHERE name = ?", (name,)).rowcount:
                file.execute("ROLLBACK")
                return False
            self._commit(file)
        return True

    def exists(self) -> bool:
        """Whether there is a file that is not empty, as a crash during its creation leaves it."""
        return self.path.exists() and (self.path.is_dir() or self.path.stat().st_size > 0)

    def names(self) -> list[str]:
        """Return all names, in the order in which they were added; none if there is no file or it is empty."""
        if not self.exists():
            return []
        with self._opened() as file:
            return [name for (name,) in file.execute("SELECT name FROM models ORDER BY id")]

    def stamp(self) -> bytes:
        """Return random bytes that identify the state of the file."""
        with self._opened() as file:
            return self._stamp(file)

    def read(self, known: set[int]) -> tuple[bytes, list[tuple[int, str]], dict[int, bytes]]:
        """Return the stamp, all identities and names in the order of addition, and the data not in `known`."""
        with self._opened() as file:
            file.execute("BEGIN")
            stamp = self._stamp(file)
            names = file.execute(f"SELECT {IDENTITY}, name FROM models ORDER BY id").fetchall()
            data = {}
            for identity, name in names:
                if identity not in known:
                    entry = file.execute("SELECT data FROM models WHERE id = ?", (identity >> 32,)).fetchone()
                    (data[identity],) = entry
                    if zlib.crc32(data[identity]) != identity & 0xFFFFFFFF:
                        raise OSError(f"{self.path} is damaged: the data of {name!r} is not what was written")
        return stamp, names, data

    @staticmethod
    def _stamp(file: sqlite3.Connection) -> bytes:
        return bytes(_scalar(file, "SELECT CAST(made AS BLOB) FROM library"))

    @staticmethod
    def _commit(file: sqlite3.Connection) -> None:
        file.execute("UPDATE library SET changes = changes + 1, made = randomblob(16)")
        file.execute("COMMIT")

    @contextmanager
    def _opened(self, *, create: bool = False) -> Iterator[sqlite3.Connection]:
        """Yield a connection; errors of SQLite become an `OSError` with one sentence."""
        import sqlite3

        if self.path.is_dir():
            raise IsADirectoryError(f"{self.path} is a folder, not a model library")
        if not self.path.exists() and not create:
            raise FileNotFoundError(f"there is no model library {self.path}")
        if not self.path.parent.is_dir():
            raise FileNotFoundError(f"there is no folder {self.path.parent} to write {self.path.name} to")
        try:
            mode = "rwc" if create else "rw" if self._writable() else "ro"
            uri = f"{file_uri(self.path.absolute())}?mode={mode}"
            file = sqlite3.connect(uri, timeout=TIMEOUT, isolation_level=None, uri=True)
            try:
                self._check_format(file, create=create)
                yield file
            finally:
                file.close()
        except (sqlite3.Error, TypeError) as error:
            raise _as_os_error(self.path, error) from None

    def _writable(self) -> bool:
        return os.access(self.path, os.W_OK) and os.access(self.path.parent, os.W_OK)

    def _check_format(self, file: sqlite3.Connection, *, create: bool) -> None:
        """Create the tables of a new file; check the format of an existing one."""
        if _scalar(file, "PRAGMA schema_version") == 0 and create:  # also after a crash during creation
            file.execute("BEGIN IMMEDIATE")
            if _scalar(file, "PRAGMA schema_version") == 0:  # not created by another process in the meantime
                for line in (f"PRAGMA application_id = {APPLICATION_ID}", f"PRAGMA user_version = {VERSION}", *TABLES):
                    file.execute(line)
            file.execute("COMMIT")
        if _scalar(file, "PRAGMA page_count") == 0:
            raise OSError(f"{self.path} is empty, not a model library")
        if _scalar(file, "PRAGMA application_id") != APPLICATION_ID:
            raise OSError(f"{self.path} is a database of another program, not a model library")
        version = _scalar(file, "PRAGMA user_version")
        if version != VERSION:
            raise OSError(f"{self.path} has format version {version} of model libraries; only {VERSION} is supported")


def _scalar(file: sqlite3.Connection, query: str) -> Any:
    return file.execute(query).fetchone()[0]


def file_uri(path: PurePath) -> str:
    """Return the URI of a path for SQLite, where network folders of Windows have no host part: file:////server/share."""
    uri = path.as_uri()
    return uri if uri.startswith("file:///") else uri.replace("file://", "file:////", 1)


def _as_os_error(path: Path, error: Exception) -> OSError:
    """Return the `OSError` for an error of SQLite."""
    message = str(error)
    if re.search("locked|readonly|full|unable to open|disk I/O error", message):
        return OSError(f"{path} cannot be used now: {message}")
    return OSError(f"{path} is not a whole model library: {message}")
