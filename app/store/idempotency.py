"""An idempotency key stands for one answer: of a run or of a batch."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import Connection, Row, RowMapping, func, select

from app.store.maintenance import lowest_id_at
from app.store.models import batches, idempotency_keys


def lock_key(connection: Connection, key: str) -> None:
    """Let other transactions that answer under this key wait until this one ends.

    The keys of runs and of batches are in two tables, so no unique constraint spans them. SQLite admits only one
    writing transaction at a time anyway.
    """
    if connection.dialect.name == "postgresql":
        connection.execute(select(func.pg_advisory_xact_lock(func.hashtextextended(key, 0))))


def run_under(connection: Connection, key: str, since: datetime | None) -> RowMapping | None:
    """The row of the response stored under a key for a run made after ``since``, None if there is none."""
    row = connection.execute(select(idempotency_keys).where(idempotency_keys.c.key == key)).mappings().first()
    return None if row is None or (since is not None and row["run_id"] < lowest_id_at(since)) else row


def batch_under(connection: Connection, key: str) -> Row[Any] | None:
    """Request hash and answer of the batch with this key, None if there is none."""
    query = select(batches.c.request_hash, batches.c.answer).where(batches.c.idempotency_key == key)
    return connection.execute(query).first()


def is_used(connection: Connection, key: str, since: datetime | None) -> bool:
    """Whether a key stands for the answer of a batch, or of a run made after ``since``."""
    return run_under(connection, key, since) is not None or batch_under(connection, key) is not None
