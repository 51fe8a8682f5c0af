"""Database faults, classified from the errors of the drivers."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum

from sqlalchemy.engine import URL
from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeout

from app.store.errors import StoreError


class FaultKind(StrEnum):
    """Kinds of database faults, worded for an operator."""

    FULL = "the disk or the database is full"
    BUSY = "the database is locked or does not answer in time"
    READ_ONLY = "the database cannot be written to"
    GONE = "the database is not there any more"
    UNREACHABLE = "the database cannot be reached"
    DAMAGED = "the database is damaged"


class StoreFault(StoreError):
    """The database cannot serve a request at present. Nothing was acknowledged."""

    def __init__(self, kind: FaultKind, reason: str = "") -> None:
        super().__init__(f"{kind}{f': {reason}' if reason else ''}")
        self.kind = kind


_SQLITE = {
    sqlite3.SQLITE_FULL: FaultKind.FULL,
    sqlite3.SQLITE_BUSY: FaultKind.BUSY,
    sqlite3.SQLITE_LOCKED: FaultKind.BUSY,
    sqlite3.SQLITE_PROTOCOL: FaultKind.BUSY,
    sqlite3.SQLITE_READONLY: FaultKind.READ_ONLY,
    sqlite3.SQLITE_PERM: FaultKind.READ_ONLY,
    sqlite3.SQLITE_CANTOPEN: FaultKind.UNREACHABLE,
    sqlite3.SQLITE_IOERR: FaultKind.UNREACHABLE,
    sqlite3.SQLITE_CORRUPT: FaultKind.DAMAGED,
    sqlite3.SQLITE_NOTADB: FaultKind.DAMAGED,
}
_POSTGRESQL = {
    "53100": FaultKind.FULL,
    "53200": FaultKind.FULL,
    "53300": FaultKind.BUSY,  # too many connections
    "55P03": FaultKind.BUSY,  # lock timeout
    "57014": FaultKind.BUSY,  # statement timeout
    "40P01": FaultKind.BUSY,  # deadlock
    "40001": FaultKind.BUSY,
    "25006": FaultKind.READ_ONLY,
    "42501": FaultKind.READ_ONLY,  # no permission
    "42P01": FaultKind.GONE,
    "3D000": FaultKind.GONE,
    "XX001": FaultKind.DAMAGED,
    "XX002": FaultKind.DAMAGED,
}


def fault_of(error: BaseException) -> StoreFault | None:
    """The fault behind a driver error; None if the error is not the database's."""
    if isinstance(error, StoreFault):
        return error
    if isinstance(error, PoolTimeout):
        return StoreFault(FaultKind.BUSY, "no free connection in the pool")
    original = error.orig if isinstance(error, DBAPIError) else error
    if isinstance(original, sqlite3.Error):
        kind = _SQLITE.get(getattr(original, "sqlite_errorcode", 0) & 0xFF)
        if kind is None and "no such table" in str(original):
            kind = FaultKind.GONE
    elif not isinstance(error, DBAPIError):
        return None
    else:
        state = getattr(original, "sqlstate", None)
        kind = _POSTGRESQL.get(state or "")
        if kind is None and (error.connection_invalidated or state is None or state[:2] in ("08", "57")):
            kind = FaultKind.UNREACHABLE if type(original).__name__ != "ProgrammingError" else None
    return None if kind is None else StoreFault(kind, str(original).splitlines()[0] if str(original) else "")


def is_write_conflict(error: BaseException) -> bool:
    """Whether the server aborted the transaction for a deadlock or serialization failure, so that it can be retried."""
    return isinstance(error, DBAPIError) and getattr(error.orig, "sqlstate", None) in ("40P01", "40001")


@contextmanager
def raising_faults() -> Iterator[None]:
    """Re-raise driver errors from within the block as StoreFault where they are database faults."""
    try:
        yield
    except Exception as error:
        fault = fault_of(error)
        if fault is None or fault is error:
            raise
        raise fault from error


class FileWatch:
    """Detects that an open SQLite file was deleted or replaced.

    SQLite would go on writing to the unlinked file, and those writes would be lost. For other databases it does
    nothing.
    """

    def __init__(self, url: URL) -> None:
        self._path = str(url.database) if url.get_backend_name() == "sqlite" else None
        self._first = self._identity()

    def check(self) -> None:
        """Raise StoreFault if the file is missing or not the one that was opened."""
        if self._path is not None and self._identity() != self._first:
            raise StoreFault(FaultKind.GONE, f"{self._path} was deleted or replaced; restart the service")

    def _identity(self) -> tuple[int, int] | None:
        if self._path is None:
            return None
        try:
            found = os.stat(self._path)
        except OSError:
            return None
        return found.st_dev, found.st_ino
