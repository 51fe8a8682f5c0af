"""Who came first to a database: held for as long as a service runs, let go by the system however it ends.

Batches are shared by leases among any number of processes; runs that were promised by a 202 are taken up by one alone.
"""

from __future__ import annotations

import fcntl
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from sqlalchemy import text

from app.store.engine import make_engine, normalised_url
from app.store.faults import told

_SERVICE_LOCK = 7_265_110_422
"""PostgreSQL's advisory lock of the service."""


class ServiceLock:
    """``held`` tells whether this is the only service on the database, or the first of several."""

    def __init__(self, url: str) -> None:
        self.held = True
        self._file: IO[str] | None = None
        self._connection: Any = None
        target = normalised_url(url)
        if target.get_backend_name() == "sqlite":
            self._lock_file(Path(str(target.database)))
        else:
            self._lock_server(url)

    def _lock_file(self, database: Path) -> None:
        # Kept beside the database: to delete it would let a second service lock another file of the same name.
        self._file = open(database.with_name(f"{database.name}.lock"), "a")  # noqa: SIM115 (held)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.release()
        except OSError:  # a file system without locks
            return

    def _lock_server(self, url: str) -> None:
        engine = make_engine(url)
        with told():
            self._connection = engine.connect().execution_options(isolation_level="AUTOCOMMIT")
            held = self._connection.execute(text("SELECT pg_try_advisory_lock(:lock)"), {"lock": _SERVICE_LOCK})
        if not held.scalar_one():
            self.release()

    def release(self) -> None:
        if self._file is not None:
            self._file.close()
        if self._connection is not None:
            engine = self._connection.engine
            self._connection.close()
            engine.dispose()
        self._file = self._connection = None
        self.held = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()
