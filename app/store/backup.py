"""Backup of an SQLite store while it is in use, and restore."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from pathlib import Path

from app.store.engine import check_exists, normalised_url, sqlite_address
from app.store.errors import StoreError
from app.store.verify import Report, verify


class CannotCopy(StoreError):
    """The backup or restore is not possible as requested."""


def backup(url: str, target: Path) -> Report:
    """Write a consistent copy of the store to a new file, and return the result of verifying the copy. Raises
    CannotCopy, MissingDatabase."""
    _check_new(target)
    source = _file(url)
    check_exists(url)
    return _copied(source, target)


def restore(url: str, source: Path) -> Report:
    """Copy a backup to the store's path, where no database may exist, and return the result of verifying it. Raises
    CannotCopy."""
    target = _file(url)
    _check_new(target)
    if not source.exists():
        raise CannotCopy(f"there is no backup at {source}")
    for rest in ("-wal", "-shm"):
        if target.with_name(target.name + rest).exists():
            raise CannotCopy(f"{target.name}{rest} belongs to another database: move it away first")
    target.parent.mkdir(parents=True, exist_ok=True)
    return _copied(source, target)


def _copied(source: Path, target: Path) -> Report:
    """Copy to a temporary name, verify, then rename."""
    unfinished = target.with_name(f"{target.name}.unfinished")
    unfinished.unlink(missing_ok=True)
    try:
        with (
            closing(sqlite3.connect(sqlite_address(source), uri=True)) as original,
            closing(sqlite3.connect(unfinished)) as copy,
        ):
            original.backup(copy)
            # A single file, without a WAL beside it.
            copy.execute("PRAGMA journal_mode=DELETE")
        with open(unfinished, "rb") as file:
            os.fsync(file.fileno())
        report = verify(f"sqlite:///{unfinished}")
        # Verifying may have switched it to WAL again.
        with closing(sqlite3.connect(unfinished)) as copy:
            copy.execute("PRAGMA journal_mode=DELETE")
        os.replace(unfinished, target)
    except sqlite3.Error as error:
        raise CannotCopy(f"the copy cannot be made: {error}") from error
    finally:
        unfinished.unlink(missing_ok=True)
    return report


def _file(url: str) -> Path:
    target = normalised_url(url)
    if target.get_backend_name() != "sqlite":
        raise CannotCopy("only SQLite is supported; use pg_dump and pg_restore for PostgreSQL")
    return Path(str(target.database))


def _check_new(target: Path) -> None:
    if target.exists():
        raise CannotCopy(f"{target} exists already and is not overwritten")
