"""An idempotency key stands for one answer: of a run or of a batch."""

from __future__ import annotations

from sqlalchemy import Connection, func, select


def lock_key(connection: Connection, key: str) -> None:
    """Let other transactions that answer under this key wait until this one ends.

    The keys of runs and of batches are in two tables, so no unique constraint spans them. SQLite admits only one
    writing transaction at a time anyway.
    """
    if connection.dialect.name == "postgresql":
        connection.execute(select(func.pg_advisory_xact_lock(func.hashtextextended(key, 0))))
