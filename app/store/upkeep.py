"""What is taken out of the store: runs when an operator says so, idempotency keys by their age."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Connection, delete, func, select, update

from app.store.keys import Note
from app.store.models import idempotency_keys, ledger, runs
from app.store.record import OPEN_STATUSES

AT_ONCE = 500
"""Rows that one transaction takes out, so that nobody waits long for it."""


def oldest_id(moment: datetime) -> str:
    """An identifier that sorts before those of all runs made from that moment on: they begin with their time."""
    milliseconds = max(0, int(moment.timestamp() * 1000))
    return str(uuid.UUID(int=milliseconds << 80))


def count_before(connection: Connection, moment: datetime) -> int:
    """How many ended runs were made before a moment."""
    wanted = select(func.count()).where(runs.c.created_at < moment, runs.c.status.not_in(OPEN_STATUSES))
    return connection.execute(wanted).scalar_one()


@dataclass(frozen=True)
class Prune:
    """Delete ended runs made before a moment, with their idempotency keys; how many there were, at most `AT_ONCE`."""

    before: datetime
    actor: str

    def __call__(self, connection: Connection) -> int:
        wanted = select(runs.c.id).where(runs.c.created_at < self.before, runs.c.status.not_in(OPEN_STATUSES))
        ids = list(connection.scalars(wanted.order_by(runs.c.created_at).limit(AT_ONCE)))
        if ids:
            connection.execute(delete(idempotency_keys).where(idempotency_keys.c.run_id.in_(ids)))
            connection.execute(delete(runs).where(runs.c.id.in_(ids)))
            connection.execute(update(ledger).values(runs=ledger.c.runs - len(ids)))
            Note(self.actor, "prune", f"{len(ids)} runs before {self.before.isoformat()}")(connection)
        return len(ids)


@dataclass(frozen=True)
class Expire:
    """Delete the idempotency keys of runs made before a moment; how many there were, at most `AT_ONCE`."""

    before: datetime

    def __call__(self, connection: Connection) -> int:
        old = idempotency_keys.c.run_id < oldest_id(self.before)
        keys = list(connection.scalars(select(idempotency_keys.c.key).where(old).limit(AT_ONCE)))
        if keys:
            connection.execute(delete(idempotency_keys).where(idempotency_keys.c.key.in_(keys)))
        return len(keys)


@dataclass(frozen=True)
class Probe:
    """Write something, to see whether one can."""

    def __call__(self, connection: Connection) -> None:
        connection.execute(update(ledger).values(probe=ledger.c.probe + 1))
