"""Leases on runs accepted with 202, as writes.

As with the chunks of batches, the process working on a run renews its lease, and any process may take over an expired
one. The end of a run deletes its lease in the same transaction (``operations.Advance``), so it ends only once.
"""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Connection, delete, insert, select, update

from app.logging import get_logger
from app.store.errors import DamagedRecord
from app.store.leases import expired, now
from app.store.models import promises, runs
from app.store.operations import Put, PutOnce
from app.store.record import RunRecord, StoredResponse
from app.store.rows import row_to_run

logger = get_logger(__name__)


@dataclass(frozen=True)
class InsertLeased:
    """Insert a run leased by ``owner`` and return the insertion's result."""

    insertion: Put | PutOnce
    owner: str
    lease_s: float

    def __call__(self, connection: Connection) -> StoredResponse | None:
        first = self.insertion(connection)
        if first is None:
            until = now(connection) + self.lease_s
            row = {"run_id": self.insertion.record.id, "owner": self.owner, "leased_until": until, "attempts": 0}
            connection.execute(insert(promises).values(row))
        return first


@dataclass(frozen=True)
class RenewLeases:
    """Renew all leases of the owner and return the ids of its runs."""

    owner: str
    lease_s: float

    def __call__(self, connection: Connection) -> set[str]:
        mine = select(promises.c.run_id).where(promises.c.owner == self.owner)
        # Rows locked by another process that ends them are skipped, to avoid a deadlock.
        renewed = update(promises).where(promises.c.run_id.in_(mine.with_for_update(skip_locked=True)))
        connection.execute(renewed.values(leased_until=now(connection) + self.lease_s))
        return set(connection.scalars(mine))


@dataclass(frozen=True)
class TakenOverRun:
    """A run taken over, and how often its solve was started."""

    run: RunRecord
    attempts: int


@dataclass(frozen=True)
class TakeOverExpired:
    """Take over runs with expired leases, oldest first, at most ``limit``."""

    owner: str
    lease_s: float
    limit: int

    def __call__(self, connection: Connection) -> list[TakenOverRun]:
        time_now = now(connection)
        left = (
            select(promises.c.run_id, promises.c.attempts)
            .where(expired(promises.c.leased_until, time_now))
            .order_by(promises.c.run_id)
            .limit(self.limit)
            .with_for_update(skip_locked=True)
        )
        attempts = {run_id: attempts for run_id, attempts in connection.execute(left).all()}
        here = promises.c.run_id.in_(attempts)
        connection.execute(update(promises).where(here).values(owner=self.owner, leased_until=time_now + self.lease_s))
        taken = []
        for row in connection.execute(select(runs).where(runs.c.id.in_(attempts)).order_by(runs.c.id)).mappings().all():
            try:
                taken.append(TakenOverRun(row_to_run(row), attempts[row["id"]]))
            except DamagedRecord as damage:  # it cannot be solved
                logger.error("record_damaged", table=damage.table, key=damage.key)
                connection.execute(delete(promises).where(promises.c.run_id == row["id"]))
        return taken


@dataclass(frozen=True)
class ReleaseLeases:
    """Release all leases of the owner on an orderly shutdown, with the attempts reset, as none of them failed."""

    owner: str

    def __call__(self, connection: Connection) -> None:
        mine = update(promises).where(promises.c.owner == self.owner)
        connection.execute(mine.values(leased_until=0.0, attempts=0))
