"""The writes that say which process works on a run that was promised by a 202.

As with the chunks of batches: whoever works on one renews its lease, and one whose lease has run out is anybody's. The
end of a run takes its promise away in the same transaction (``operations.Advance``), so it ends once.
"""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import Connection, delete, insert, select, update

from app.logging import get_logger
from app.store.errors import DamagedRecord
from app.store.leases import now
from app.store.models import promises, runs
from app.store.operations import Put, PutOnce
from app.store.record import RunRecord, StoredResponse
from app.store.rows import row_to_run

logger = get_logger(__name__)


@dataclass(frozen=True)
class Promise:
    """Insert a run as promised by its owner; what the insertion itself returns."""

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
class HoldOn:
    """Renew everything that the owner has leased; the ids of those runs."""

    owner: str
    lease_s: float

    def __call__(self, connection: Connection) -> set[str]:
        mine = select(promises.c.run_id).where(promises.c.owner == self.owner)
        # What another process is about to end is not waited for: two would wait for each other.
        renewed = update(promises).where(promises.c.run_id.in_(mine.with_for_update(skip_locked=True)))
        connection.execute(renewed.values(leased_until=now(connection) + self.lease_s))
        return set(connection.scalars(mine))


@dataclass(frozen=True)
class TakenOver:
    """A run that another process had promised, and how often its solve was begun."""

    run: RunRecord
    attempts: int


@dataclass(frozen=True)
class TakeOver:
    """Lease runs whose process gives no sign of life, oldest first."""

    owner: str
    lease_s: float
    most: int

    def __call__(self, connection: Connection) -> list[TakenOver]:
        time_now = now(connection)
        left = (
            select(promises.c.run_id, promises.c.attempts)
            .where(promises.c.leased_until < time_now)
            .order_by(promises.c.run_id)
            .limit(self.most)
            .with_for_update(skip_locked=True)
        )
        attempts = {run_id: attempts for run_id, attempts in connection.execute(left)}
        here = promises.c.run_id.in_(attempts)
        connection.execute(update(promises).where(here).values(owner=self.owner, leased_until=time_now + self.lease_s))
        taken = []
        for row in connection.execute(select(runs).where(runs.c.id.in_(attempts)).order_by(runs.c.id)).mappings():
            try:
                taken.append(TakenOver(row_to_run(row), attempts[row["id"]]))
            except DamagedRecord as damage:  # nobody can work on it
                logger.error("record_damaged", table=damage.table, key=damage.key)
                connection.execute(delete(promises).where(promises.c.run_id == row["id"]))
        return taken


@dataclass(frozen=True)
class LetGo:
    """Give back everything that the owner has leased: it ends as it should, so no attempt was in vain."""

    owner: str

    def __call__(self, connection: Connection) -> None:
        mine = update(promises).where(promises.c.owner == self.owner)
        connection.execute(mine.values(leased_until=0.0, attempts=0))
