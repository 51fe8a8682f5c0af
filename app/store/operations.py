"""Writes of runs, as operations that the writer runs in its transactions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from sqlalchemy import Connection, delete, select, update

from app.store.errors import DamagedRecord, IdempotencyConflict, UnknownRun
from app.store.idempotency import batch_under, lock_key, run_under
from app.store.insertion import Insertion
from app.store.models import idempotency_keys, promises, runs
from app.store.record import OPEN_STATUSES, Finish, RunRecord, RunStatus, StoredResponse
from app.store.rows import check, response_to_row, row_to_response, row_to_run, run_to_row

INSERT_RUN, INSERT_RESPONSE = Insertion(runs), Insertion(idempotency_keys)


@dataclass(frozen=True)
class Put:
    """Insert a run; several in one group are inserted in one call."""

    record: RunRecord

    def __call__(self, connection: Connection) -> None:
        INSERT_RUN(connection, run_to_row(self.record))

    @staticmethod
    def together(connection: Connection, operations: Sequence[Put]) -> list[None]:
        INSERT_RUN(connection, *(run_to_row(operation.record) for operation in operations))
        return [None] * len(operations)


@dataclass(frozen=True)
class PutOnce:
    """Insert a run and the response stored under its idempotency key.

    Returns None after inserting; if the key was used before by the same request, inserts nothing and returns the stored
    response. Raises IdempotencyConflict if it was used by another request, also by that of a batch.
    """

    record: RunRecord
    response: StoredResponse
    since: datetime | None = None

    def __call__(self, connection: Connection) -> StoredResponse | None:
        lock_key(connection, self.response.key)
        first = find_response(connection, self.response.key, self.response.request_hash, self.since)
        if first is not None:
            return first
        # an expired one is replaced
        connection.execute(delete(idempotency_keys).where(idempotency_keys.c.key == self.response.key))
        INSERT_RUN(connection, run_to_row(self.record))
        INSERT_RESPONSE(connection, response_to_row(self.response, self.record))
        return None


@dataclass(frozen=True)
class Advance:
    """Mark an open run as running, or end it and its lease. Returns False if it had ended. Raises UnknownRun."""

    run_id: str
    change: Finish | None

    def __call__(self, connection: Connection) -> bool:
        row = connection.execute(select(runs).where(runs.c.id == self.run_id).with_for_update()).mappings().first()
        if row is None:
            raise UnknownRun(self.run_id)
        record = row_to_run(row)
        if record.status not in OPEN_STATUSES:
            return False
        change = {"status": RunStatus.RUNNING} if self.change is None else vars(self.change)
        row = run_to_row(replace(record, **change))
        connection.execute(update(runs).where(runs.c.id == self.run_id).values(row))
        leased = promises.c.run_id == self.run_id
        if self.change is None:
            connection.execute(update(promises).where(leased).values(attempts=promises.c.attempts + 1))
        else:
            connection.execute(delete(promises).where(leased))
        return True


def find_response(
    connection: Connection, key: str, request_hash: str, since: datetime | None = None
) -> StoredResponse | None:
    """The response stored under a key for a run made after ``since``.

    Raises IdempotencyConflict if the key belongs to another request or to a batch, and DamagedRecord.
    """
    row = run_under(connection, key, since)
    if row is None:
        if batch_under(connection, key) is not None:
            raise IdempotencyConflict(key)
        return None
    check(idempotency_keys.name, "key", row)
    if row["request_hash"] != request_hash:
        raise IdempotencyConflict(key)
    run = connection.execute(select(runs).where(runs.c.id == row["run_id"])).mappings().first()
    if run is None:
        raise DamagedRecord(runs.name, row["run_id"])
    return row_to_response(row, row_to_run(run))
