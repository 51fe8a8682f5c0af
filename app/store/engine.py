"""Engines: SQLite in WAL with FULL synchronisation, or PostgreSQL through psycopg, by URL."""

from __future__ import annotations

import os
import sqlite3
import time
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, OperationalError

from app.store.errors import InvalidDatabaseUrl, MissingDatabase, StoreError

BUSY_TIMEOUT_MS = 4_000
"""Timeout for locks, statements and connecting."""
_LONG_TIMEOUT_MS = 60_000
"""Timeout for long-running work without a client: migrations and verification."""

WRITE = {"crankwright_write": True}
"""Execution options of a connection that will write: SQLite then takes the write lock at BEGIN."""
BY_DRIVER = {"crankwright_by_driver": True}
"""Execution options of a connection to SQLite whose owner begins and ends transactions on the driver itself."""


def normalised_url(url: str) -> URL:
    """The URL with the bundled driver: ``postgresql://`` and ``postgres://`` mean psycopg 3. Raises InvalidDatabaseUrl,
    also for an in-memory SQLite database."""
    try:
        parsed = make_url(url.replace("postgres://", "postgresql://", 1) if url.startswith("postgres://") else url)
    except (ArgumentError, ValueError):
        raise InvalidDatabaseUrl(url) from None
    if parsed.drivername == "postgresql":
        return _with_password(parsed.set(drivername="postgresql+psycopg"))
    if parsed.drivername not in _DRIVERS:
        raise InvalidDatabaseUrl(url, "a database or driver that is not supported")
    if parsed.get_backend_name() == "sqlite" and parsed.database in (None, "", ":memory:"):
        raise InvalidDatabaseUrl(url, "but names no file, and an in-memory database keeps nothing")
    return parsed


def check_exists(url: str) -> None:
    """For commands that only read: an engine would create the file. Raises MissingDatabase unless an SQLite database
    has its file."""
    target = normalised_url(url)
    if target.get_backend_name() == "sqlite" and not Path(str(target.database)).exists():
        raise MissingDatabase(Path(str(target.database)))


_DRIVERS = ("sqlite", "sqlite+pysqlite", "postgresql+psycopg")
PASSWORD_FILE = "CRANKWRIGHT_DATABASE_PASSWORD_FILE"
"""Variable that names a file with the server's password, which then appears in no URL and no environment variable."""


def _with_password(url: URL) -> URL:
    file = os.environ.get(PASSWORD_FILE)
    if file is None or url.password is not None:
        return url
    try:
        return url.set(password=Path(file).read_text("utf-8").strip())
    except (OSError, UnicodeDecodeError) as error:
        raise StoreError(f"{PASSWORD_FILE}: {file} cannot be read ({error})") from None


def make_engine(url: str, long_running: bool = False) -> Engine:
    """Create an engine; acknowledged commits survive a power failure on both databases.

    ``long_running`` relaxes the timeouts, for work without a waiting client.
    """
    target, wait_ms = normalised_url(url), _LONG_TIMEOUT_MS if long_running else BUSY_TIMEOUT_MS
    if target.get_backend_name() != "sqlite":
        statement_ms = 0 if long_running else wait_ms
        return create_engine(
            target,
            pool_pre_ping=True,
            pool_size=6,
            max_overflow=6,
            pool_timeout=wait_ms / 1000,
            connect_args={
                "connect_timeout": BUSY_TIMEOUT_MS // 1000,
                "tcp_user_timeout": BUSY_TIMEOUT_MS,
                "options": f"-c lock_timeout={wait_ms} -c statement_timeout={statement_ms}",
            },
        )
    Path(str(target.database)).parent.mkdir(parents=True, exist_ok=True)
    engine = create_engine(
        target,
        pool_size=6,
        max_overflow=6,
        pool_timeout=wait_ms / 1000,
        connect_args={"timeout": BUSY_TIMEOUT_MS / 1000, "check_same_thread": False},
    )
    event.listen(engine, "do_connect", _address_sqlite)
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def sqlite_address(file: Path | str) -> str:
    """The URI by which SQLite opens a file. Without permission to write in its folder, not even a reader can make the
    files that WAL needs; where none are beside it nobody has it open, and it is read as a file that does not change."""
    path = Path(file).resolve()
    is_closed = path.exists() and not any(path.with_name(path.name + rest).exists() for rest in ("-wal", "-journal"))
    can_write = os.access(path.parent, os.W_OK) and os.access(path, os.W_OK)
    return path.as_uri() + ("?mode=ro&immutable=1" if is_closed and not can_write else "")


def _address_sqlite(_dialect: Any, _record: Any, arguments: list[Any], options: dict[str, Any]) -> None:
    arguments[0], options["uri"] = sqlite_address(arguments[0]), True


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    # The driver must not open transactions implicitly; see _begin_sqlite.
    connection.isolation_level = None
    # SQLite's own knows only ASCII.
    connection.create_function("lower", 1, _lower, deterministic=True)
    cursor = connection.cursor()
    try:
        cursor.execute(f"PRAGMA busy_timeout={BUSY_TIMEOUT_MS}")
        _switch_to_wal(cursor)
        cursor.execute("PRAGMA synchronous=FULL")
        cursor.execute("PRAGMA foreign_keys=ON")
    finally:
        cursor.close()


def _lower(text: Any) -> Any:
    return text.lower() if isinstance(text, str) else text


def _switch_to_wal(cursor: Any) -> None:
    """Switch the file to WAL. The mode is persistent; during the switch SQLite ignores the busy timeout, hence the
    retries."""
    end = time.monotonic() + BUSY_TIMEOUT_MS / 1000
    while True:
        try:
            cursor.execute("PRAGMA journal_mode=WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF not in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
                raise
            if time.monotonic() > end:
                raise
            time.sleep(0.01)


def _begin_sqlite(connection: Connection) -> None:
    # A deferred transaction that reads and then writes fails immediately if another writer came in between; taking the
    # write lock at BEGIN makes it wait instead. Executing BEGIN through SQLAlchemy takes four times as long.
    options = connection.get_execution_options()
    if options.get("crankwright_by_driver", False):
        return
    write = options.get("crankwright_write", False)
    statement = "BEGIN IMMEDIATE" if write else "BEGIN"
    try:
        connection.connection.driver_connection.execute(statement)  # type: ignore[union-attr]
    except sqlite3.Error as error:
        raise OperationalError(statement, None, error) from error
