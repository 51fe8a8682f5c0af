"""The writes, as operations on a connection inside a transaction that the writer owns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from sqlalchemy import Connection, insert, select, update

from app.store.errors import IdempotencyConflict, UnknownRun
from app.store.models import idempotency_keys, runs
from app.store.record import OPEN_STATUSES, Finish, RunRecord, RunStatus, StoredResponse
from app.store.rows import response_to_row, row_to_response, row_to_run, run_to_row

INSERT_RUN = insert(runs)
INSERT_RESPONSE = insert(idempotency_keys)


@dataclass(frozen=True)
class Put:
    """Insert a run. Many in one group go to the database in one call."""

    record: RunRecord

    def __call__(self, connection: Connection) -> None:
        connection.execute(INSERT_RUN, run_to_row(self.record))

    @staticmethod
    def together(connection: Connection, operations: Sequence[Put]) -> list[None]:
        connection.execute(INSERT_RUN, [run_to_row(operation.record) for operation in operations])
        return [None] * len(operations)


@dataclass(frozen=True)
class PutOnce:
    """Insert a run and the answer kept under its idempotency key.

    Returns None when both are in, or the answer of the request that used the key first; then nothing is
    inserted.
    """

    record: RunRecord
    response: StoredResponse

    def __call__(self, connection: Connection) -> StoredResponse | None:
        first = find_response(connection, self.response.key, self.response.request_hash)
        if first is not None:
            return first
        connection.execute(INSERT_RUN, run_to_row(self.record))
        connection.execute(INSERT_RESPONSE, response_to_row(self.response))
        return None


@dataclass(frozen=True)
class Advance:
    """Move an open run on: to running, or to its end. Returns False if the run had ended already."""

    run_id: str
    change: Finish | None

    def __call__(self, connection: Connection) -> bool:
        row = connection.execute(select(runs).where(runs.c.id == self.run_id).with_for_update()).mappings().first()
        if row is None:
            raise UnknownRun(self.run_id)
        record = row_to_run(row)
        if record.status not in OPEN_STATUSES:
            return False
        _rewrite(connection, _changed(record, self.change))
        return True


def find_response(connection: Connection, key: str, request_hash: str) -> StoredResponse | None:
    """The answer kept under the key; a conflict if the key belongs to another request."""
    row = connection.execute(select(idempotency_keys).where(idempotency_keys.c.key == key)).mappings().first()
    if row is None:
        return None
    if row["request_hash"] != request_hash:
        raise IdempotencyConflict(key)
    return row_to_response(row)


def _changed(record: RunRecord, change: Finish | None) -> RunRecord:
    if change is None:
        return replace(record, status=RunStatus.RUNNING)
    return replace(
        record,
        status=change.status,
        result=change.result,
        problem=change.problem,
        effects=change.effects,
        accuracy=change.accuracy,
        timing=change.timing,
        verdict=change.verdict,
        holds=change.holds,
    )


def _rewrite(connection: Connection, record: RunRecord) -> None:
    row = run_to_row(record)
    connection.execute(update(runs).where(runs.c.id == record.id).values(row))
