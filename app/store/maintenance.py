"""Deletion: runs on an operator's request, idempotency keys by age; and the probe write of readiness checks."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Connection, delete, func, select, update

from app.store.keys import WriteAudit
from app.store.models import idempotency_keys, ledger, runs
from app.store.record import OPEN_STATUSES

ROWS_PER_TRANSACTION = 500
"""Rows deleted per transaction, so that other writes wait only briefly."""


def lowest_id_at(moment: datetime) -> str:
    """An id that sorts before those of all runs made from that moment on, since run ids start with the time."""
    milliseconds = max(0, int(moment.timestamp() * 1000))
    return str(uuid.UUID(int=milliseconds << 80))


def count_before(connection: Connection, moment: datetime) -> int:
    """Number of ended runs made before a moment."""
    wanted = select(func.count()).where(runs.c.created_at < moment, runs.c.status.not_in(OPEN_STATUSES))
    return connection.execute(wanted).scalar_one()


@dataclass(frozen=True)
class Prune:
    """Delete ended runs made before a moment, with their idempotency keys. Returns the number deleted, at most
    ``ROWS_PER_TRANSACTION``."""

    before: datetime
    actor: str

    def __call__(self, connection: Connection) -> int:
        wanted = select(runs.c.id).where(runs.c.created_at < self.before, runs.c.status.not_in(OPEN_STATUSES))
        ids = list(connection.scalars(wanted.order_by(runs.c.created_at).limit(ROWS_PER_TRANSACTION)))
        if ids:
            connection.execute(delete(idempotency_keys).where(idempotency_keys.c.run_id.in_(ids)))
            connection.execute(delete(runs).where(runs.c.id.in_(ids)))
            connection.execute(update(ledger).values(runs=ledger.c.runs - len(ids)))
            WriteAudit(self.actor, "prune", f"{len(ids)} runs before {self.before.isoformat()}")(connection)
        return len(ids)


@dataclass(frozen=True)
class ExpireKeys:
    """Delete idempotency keys of runs made before a moment. Returns the number deleted, at most
    ``ROWS_PER_TRANSACTION``."""

    before: datetime

    def __call__(self, connection: Connection) -> int:
        old = idempotency_keys.c.run_id < lowest_id_at(self.before)
        keys = list(connection.scalars(select(idempotency_keys.c.key).where(old).limit(ROWS_PER_TRANSACTION)))
        if keys:
            connection.execute(delete(idempotency_keys).where(idempotency_keys.c.key.in_(keys)))
        return len(keys)


@dataclass(frozen=True)
class Probe:
    """A write without effect, to check that the database accepts writes."""

    def __call__(self, connection: Connection) -> None:
        connection.execute(update(ledger).values(probe=ledger.c.probe + 1))
