"""Copies of an SQLite store while it is in use, and back."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from pathlib import Path

from app.store.engine import normalised_url
from app.store.errors import StoreError
from app.store.verify import Report, verify


class CannotCopy(StoreError):
    """A backup or a restore that cannot be made as asked."""


def backup(url: str, target: Path) -> Report:
    """Write a copy of the store, as it is at one moment, to a new file; what verifying the copy found."""
    _check_new(target)
    source = _file(url)
    if not source.exists():
        raise CannotCopy(f"there is no database at {source}")
    return _copied(source, target)


def restore(url: str, source: Path) -> Report:
    """Put a backup where the store is to be, which must not be there any more; what verifying it found."""
    target = _file(url)
    _check_new(target)
    if not source.exists():
        raise CannotCopy(f"there is no backup at {source}")
    for rest in ("-wal", "-shm"):
        if target.with_name(target.name + rest).exists():
            raise CannotCopy(f"{target.name}{rest} is left of another database: move it away first")
    target.parent.mkdir(parents=True, exist_ok=True)
    return _copied(source, target)


def _copied(source: Path, target: Path) -> Report:
    """Copy, verify the copy, and only then give it its name."""
    unfinished = target.with_name(f"{target.name}.unfinished")
    unfinished.unlink(missing_ok=True)
    try:
        with closing(sqlite3.connect(source)) as original, closing(sqlite3.connect(unfinished)) as copy:
            original.backup(copy)
            # One file, without a journal beside it.
            copy.execute("PRAGMA journal_mode=DELETE")
        with open(unfinished, "rb") as file:
            os.fsync(file.fileno())
        report = verify(f"sqlite:///{unfinished}")
        # The look at it may have left the files of a journal again.
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
        raise CannotCopy("this copies SQLite files; of PostgreSQL make backups with pg_dump, restore with pg_restore")
    return Path(str(target.database))


def _check_new(target: Path) -> None:
    if target.exists():
        raise CannotCopy(f"{target} is there already; nothing is overwritten")
