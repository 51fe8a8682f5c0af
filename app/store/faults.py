"""What can be wrong with a database, told from what its driver raises."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path

from sqlalchemy.engine import URL
from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeout

from app.store.errors import StoreError


class Trouble(StrEnum):
    """What is wrong, in words for an operator."""

    FULL = "the disk or the database is full"
    BUSY = "the database is locked or does not answer in time"
    READ_ONLY = "the database cannot be written to"
    GONE = "the database is not there any more"
    UNREACHABLE = "the database cannot be reached"
    DAMAGED = "the database is damaged"


class StoreFault(StoreError):
    """The database cannot do now what it must. Nothing was acknowledged."""

    def __init__(self, trouble: Trouble, reason: str = "") -> None:
        super().__init__(f"{trouble}{f': {reason}' if reason else ''}")
        self.trouble = trouble


_SQLITE = {
    sqlite3.SQLITE_FULL: Trouble.FULL,
    sqlite3.SQLITE_BUSY: Trouble.BUSY,
    sqlite3.SQLITE_LOCKED: Trouble.BUSY,
    sqlite3.SQLITE_PROTOCOL: Trouble.BUSY,
    sqlite3.SQLITE_READONLY: Trouble.READ_ONLY,
    sqlite3.SQLITE_PERM: Trouble.READ_ONLY,
    sqlite3.SQLITE_CANTOPEN: Trouble.UNREACHABLE,
    sqlite3.SQLITE_IOERR: Trouble.UNREACHABLE,
    sqlite3.SQLITE_CORRUPT: Trouble.DAMAGED,
    sqlite3.SQLITE_NOTADB: Trouble.DAMAGED,
}
_POSTGRESQL = {
    "53100": Trouble.FULL,
    "53200": Trouble.FULL,
    "53300": Trouble.BUSY,  # too many connections
    "55P03": Trouble.BUSY,  # a lock was not had in time
    "57014": Trouble.BUSY,  # a statement took too long
    "40P01": Trouble.BUSY,  # deadlock
    "40001": Trouble.BUSY,
    "25006": Trouble.READ_ONLY,
    "42501": Trouble.READ_ONLY,  # no permission
    "42P01": Trouble.GONE,
    "3D000": Trouble.GONE,
    "XX001": Trouble.DAMAGED,
    "XX002": Trouble.DAMAGED,
}


def fault_of(error: BaseException) -> StoreFault | None:
    """The fault that a driver's error stands for; None where the error is the code's own."""
    if isinstance(error, StoreFault):
        return error
    if isinstance(error, PoolTimeout):
        return StoreFault(Trouble.BUSY, "no connection came free")
    if not isinstance(error, DBAPIError):
        return None
    original = error.orig
    if isinstance(original, sqlite3.Error):
        trouble = _SQLITE.get(getattr(original, "sqlite_errorcode", 0) & 0xFF)
        if trouble is None and "no such table" in str(original):
            trouble = Trouble.GONE
    else:
        state = getattr(original, "sqlstate", None)
        trouble = _POSTGRESQL.get(state or "")
        if trouble is None and (error.connection_invalidated or state is None or state[:2] in ("08", "57")):
            trouble = Trouble.UNREACHABLE if type(original).__name__ != "ProgrammingError" else None
    return None if trouble is None else StoreFault(trouble, str(original).splitlines()[0] if str(original) else "")


def collided(error: BaseException) -> bool:
    """Whether two transactions stood in each other's way, and the server ended this one: it may be tried again."""
    return isinstance(error, DBAPIError) and getattr(error.orig, "sqlstate", None) in ("40P01", "40001")


@contextmanager
def told() -> Iterator[None]:
    """What the driver raises within comes out as a StoreFault where it is one."""
    try:
        yield
    except Exception as error:
        fault = fault_of(error)
        if fault is None or fault is error:
            raise
        raise fault from error


class FileWatch:
    """Whether an SQLite file is still the one that was opened: one that was deleted goes on to take writes, for ever
    out of everybody's sight. For other databases it sees nothing wrong."""

    def __init__(self, url: URL) -> None:
        self._path = Path(str(url.database)) if url.get_backend_name() == "sqlite" else None
        self._first = self._identity()

    def check(self) -> None:
        """Raises StoreFault when the file is another one, or none."""
        if self._path is not None and self._identity() != self._first:
            raise StoreFault(Trouble.GONE, f"{self._path} was deleted or replaced; restart the service")

    def _identity(self) -> tuple[int, int] | None:
        if self._path is None:
            return None
        try:
            found = os.stat(self._path)
        except OSError:
            return None
        return found.st_dev, found.st_ino
