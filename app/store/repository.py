"""The store's interface for the rest of the service: put, finish, find, list."""

from __future__ import annotations

import asyncio
import base64
import binascii
import contextvars
import json
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime, timedelta
from types import TracebackType
from typing import Any, Self, TypeVar

from sqlalchemy import ColumnElement, Connection, Select, select, tuple_

from app.store.batch_reads import find_batch
from app.store.batch_records import BatchRecord
from app.store.engine import make_engine
from app.store.errors import DamagedRecord, InvalidCursor, UnknownRun
from app.store.faults import FaultKind, FileWatch, StoreFault, raising_faults
from app.store.item_runs import Place, get_item_run, list_item_runs
from app.store.maintenance import ExpireKeys, Probe
from app.store.models import runs
from app.store.operations import Advance, Put, PutOnce, find_response
from app.store.recent import RecentSpecs
from app.store.record import (
    ANSWERED_STATUSES,
    Finish,
    RunFilter,
    RunOrder,
    RunPage,
    RunRecord,
    RunSummary,
    StoredResponse,
    utc_now,
)
from app.store.rows import SUMMARY_FIELDS, is_intact, row_to_run, row_to_summary
from app.store.run_leases import InsertLeased
from app.store.viewer import Viewer, own_key, viewer
from app.store.writer import GroupWriter, Operation

T = TypeVar("T")

MAX_PAGE = 200
"""Maximum number of runs on a page."""

RECENT_SPECS = 20_000
"""Number of recent specs among which repeated ones are recognised."""

READ_TIMEOUT_S = 5.0
"""Timeout of a read, including the wait for a thread."""
PROBE_INTERVAL_S = 2.0
"""Minimum interval between write probes of readiness checks."""

CommitListener = Callable[[float, StoreFault | None], None]


def ignore_commit(_seconds: float, _fault: StoreFault | None) -> None:
    """No-op listener."""


READER_THREADS = 4
"""Each thread holds at most one connection."""
ID_LENGTH = 36
"""Length of a UUID in text form."""


class RunStore:
    """Durable runs in one database, migrated beforehand with ``app.store.migrate.upgrade``.

    An awaited write returns after its commit is durable. Writes go through one thread and share commits; reads use a
    small thread pool. ``close`` commits pending writes.
    """

    def __init__(
        self,
        url: str,
        write_capacity: int = 4096,
        key_lifetime: timedelta | None = None,
        on_commit: CommitListener = ignore_commit,
    ) -> None:
        """``key_lifetime``: how long idempotency keys are valid, None for ever; ``on_commit`` receives each write
        group's duration and fault. Raises StoreFault."""
        self._engine = make_engine(url)
        with raising_faults():
            self._engine.connect().close()
        self._watch = FileWatch(self._engine.url)
        self._key_lifetime, self._on_commit = key_lifetime, on_commit
        self._fault: StoreFault | None = None
        self._probed = -PROBE_INTERVAL_S
        self._writer = GroupWriter(self._engine, write_capacity, check=self._watch.check, on_commit=self._committed)
        self._readers = ThreadPoolExecutor(READER_THREADS, thread_name_prefix="store-reader")
        self._recent = RecentSpecs(RECENT_SPECS)
        self._recent.fill(reversed(self.read(_newest_specs)))

    # -- writes ---------------------------------------------------------------------------------------------

    async def put(self, record: RunRecord, response: StoredResponse | None = None) -> StoredResponse | None:
        """Insert a run, with the response to store under its idempotency key, if any.

        Returns None once the run is durable. If a request with the same key and body was first, inserts nothing and
        returns its response; raises IdempotencyConflict if it had another body.
        """
        first = await self._writer.submit(self._insertion(record, response))
        self._recent.add(record.spec_hash)
        return first

    async def put_leased(
        self, record: RunRecord, response: StoredResponse | None, owner: str, lease_s: float
    ) -> StoredResponse | None:
        """``put`` of an open run leased by ``owner``; see ``app.store.run_leases``."""
        first = await self._writer.submit(InsertLeased(self._insertion(record, response), owner, lease_s))
        self._recent.add(record.spec_hash)
        return first

    def put_and_wait(self, record: RunRecord, response: StoredResponse | None = None) -> StoredResponse | None:
        """Blocking ``put`` for code without an event loop."""
        first = self._writer.submit_and_wait(self._insertion(record, response))
        self._recent.add(record.spec_hash)
        return first

    async def start(self, run_id: str) -> bool:
        """Queued → running. False if the run had already ended, for example by cancellation."""
        return await self._writer.submit(Advance(run_id, None))

    async def finish(self, run_id: str, end: Finish) -> bool:
        """Queued or running → ended, in one transaction. False, without a change, if it had already ended."""
        return await self._writer.submit(Advance(run_id, end))

    async def write(self, operation: Operation) -> Any:
        """Run an operation of this package and wait for its commit."""
        return await self._writer.submit(operation)

    def write_and_wait(self, operation: Operation) -> Any:
        """Blocking ``write`` for code without an event loop."""
        return self._writer.submit_and_wait(operation)

    # -- reads ----------------------------------------------------------------------------------------------

    async def get(self, run_id: str) -> RunRecord:
        """The run with this id. Raises UnknownRun, also if the viewer may not see it, and DamagedRecord."""
        who = viewer.get()
        record = await self._read(lambda connection: _get(connection, run_id))
        if not who.everything and record.owner != who.owner:
            raise UnknownRun(run_id)
        return record

    async def find_response(self, key: str, request_hash: str) -> StoredResponse | None:
        """The response stored under an idempotency key, None for a new key. Raises IdempotencyConflict."""
        own = own_key(key)
        return await self._read(lambda connection: find_response(connection, own, request_hash, self.keys_valid_since))

    async def find_answer(self, spec_hash: str, solver_name: str, solver_version: str) -> RunRecord | None:
        """The newest intact run of the same spec answered (succeeded or infeasible) by the same solver version.

        Searches only the ``RECENT_SPECS`` newest specs and the viewer's own runs.
        """
        if spec_hash not in self._recent:
            return None
        solver, owner = (solver_name, solver_version), viewer.get().owner
        return await self._read(lambda connection: _find_answer(connection, spec_hash, solver, owner))

    async def list_runs(
        self, wanted: RunFilter, cursor: str | None = None, limit: int = 50, order: RunOrder = RunOrder.NEWEST
    ) -> RunPage:
        """A page of runs in the given order; runs inserted between two pages shift nothing. ``limit`` is 1…200.

        Items of a batch are listed only if the filter names the batch. Raises InvalidCursor for a cursor that this
        store did not issue.
        """
        after = _decode_cursor(cursor, order) if cursor is not None else None
        size = max(1, min(limit, MAX_PAGE))
        who = viewer.get()
        return await self._read(lambda connection: _list(connection, wanted, after, size, order, who))

    async def ping(self) -> None:
        """Raise StoreFault unless the database answers, has the tables, accepts writes and is not known to be damaged.

        A write is attempted every few seconds, and on every call after a failed one.
        """
        fault = self._fault
        if fault is not None and fault.kind is FaultKind.DAMAGED:
            raise fault
        if fault is not None or time.monotonic() - self._probed >= PROBE_INTERVAL_S:
            await self._writer.submit(Probe())
            self._probed = time.monotonic()
        await self._read(lambda connection: connection.execute(select(runs.c.id).limit(1)).first())

    async def expire_keys(self) -> int:
        """Delete expired idempotency keys; returns their number."""
        since, deleted = self.keys_valid_since, 0
        while since is not None and (count := await self._writer.submit(ExpireKeys(since))):
            deleted += count
        return deleted

    def _insertion(self, record: RunRecord, response: StoredResponse | None) -> Put | PutOnce:
        if response is None:
            return Put(record)
        return PutOnce(record, replace(response, key=own_key(response.key)), self.keys_valid_since)

    @property
    def keys_valid_since(self) -> datetime | None:
        """Creation time of runs from which idempotency keys are still valid; None if they do not expire."""
        return None if self._key_lifetime is None else utc_now() - self._key_lifetime

    def _committed(self, seconds: float, fault: StoreFault | None) -> None:
        self._record_fault(fault)
        self._on_commit(seconds, fault)

    def _record_fault(self, fault: StoreFault | None) -> None:
        """Remember a fault until a write succeeds; damage is permanent."""
        if self._fault is None or self._fault.kind is not FaultKind.DAMAGED:
            self._fault = fault

    # -- lifecycle ------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Commit pending writes and close the database."""
        self._writer.close()
        self._readers.shutdown()
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    async def query(self, query: Callable[[Connection], T]) -> T:
        """``read`` in the thread pool."""
        return await self._reading(query)

    def _reading(self, query: Callable[[Connection], T]) -> asyncio.Future[T]:
        # the thread acts as the caller's viewer
        context = contextvars.copy_context()
        return asyncio.get_running_loop().run_in_executor(self._readers, context.run, self.read, query)

    async def _read(self, query: Callable[[Connection], T]) -> T:
        try:
            return await asyncio.wait_for(self._reading(query), READ_TIMEOUT_S)
        except TimeoutError:
            raise StoreFault(FaultKind.BUSY, "reads timed out in the queue") from None

    def read(self, query: Callable[[Connection], T]) -> T:
        """Run a query on a connection of its own. Raises StoreFault."""
        self._watch.check()
        try:
            with raising_faults(), self._engine.connect() as connection:
                return query(connection)
        except StoreFault as fault:
            if fault.kind is FaultKind.DAMAGED:
                self._record_fault(fault)
            raise


def _get(connection: Connection, run_id: str) -> RunRecord:
    # Anything else is no id; not every database accepts every character.
    known = len(run_id) == ID_LENGTH and run_id.isprintable()
    try:
        row = connection.execute(select(runs).where(runs.c.id == run_id)).mappings().first() if known else None
    except (ValueError, TypeError, AttributeError) as error:  # an invalid timestamp
        raise DamagedRecord(runs.name, run_id) from error
    if not known:
        raise UnknownRun(run_id)
    return get_item_run(connection, run_id) if row is None else row_to_run(row)


def _newest_specs(connection: Connection) -> list[str]:
    return list(connection.scalars(select(runs.c.spec_hash).order_by(runs.c.id.desc()).limit(RECENT_SPECS)))


def _find_answer(
    connection: Connection, spec_hash: str, solver: tuple[str, str], owner: str | None
) -> RunRecord | None:
    query = (
        select(runs)
        .where(
            runs.c.spec_hash == spec_hash,
            runs.c.solver_name == solver[0],
            runs.c.solver_version == solver[1],
            runs.c.owner.is_(None) if owner is None else runs.c.owner == owner,
            runs.c.status.in_(ANSWERED_STATUSES),
        )
        .order_by(runs.c.id.desc())
        .limit(1)
    )
    row = connection.execute(query).mappings().first()
    # A damaged row must not be copied into new answers.
    return row_to_run(row) if row is not None and is_intact(runs.name, row) else None


_KEYS = {
    RunOrder.NEWEST: (runs.c.id, True),
    RunOrder.OLDEST: (runs.c.id, False),
    RunOrder.NAME: (runs.c.name, False),
    RunOrder.LEAST: (runs.c.figure, False),
    RunOrder.GREATEST: (runs.c.figure, True),
}
"""Sort column of each order, and whether descending; ties are broken by id."""


def _list(
    connection: Connection,
    wanted: RunFilter,
    after: Place | None,
    size: int,
    order: RunOrder,
    who: Viewer,
) -> RunPage:
    batch = None if wanted.batch_id is None else find_batch(connection, wanted.batch_id)
    if batch is not None:
        return _list_batch(connection, batch, wanted, after, size, order)
    column, descending = _KEYS[order]
    query = _filtered(select(runs), wanted)
    if not who.everything:
        query = query.where(runs.c.owner == who.owner)
    if column is not runs.c.id:
        query = query.where(column.is_not(None))
    if after is not None:
        query = query.where(_beyond(column, descending, after))
    ends = (runs.c.id,) if column is runs.c.id else (column, runs.c.id)
    query = query.order_by(*(end.desc() if descending else end.asc() for end in ends))
    rows = connection.execute(query.limit(size + 1)).mappings().all()
    items, damaged = [], []
    for row in rows[:size]:
        try:
            items.append(row_to_summary(row))
        except DamagedRecord as damage:
            damaged.append(damage.key)
    last = rows[size - 1] if len(rows) > size else None
    cursor = None if last is None else _encode_cursor(last[column.name], last["id"])
    return RunPage(tuple(items), cursor, tuple(damaged))


def _list_batch(
    connection: Connection,
    batch: BatchRecord,
    wanted: RunFilter,
    after: Place | None,
    size: int,
    order: RunOrder,
) -> RunPage:
    found, damaged, last = list_item_runs(connection, batch, wanted, after, size, order)
    items = tuple(RunSummary(**{name: getattr(run, name) for name in SUMMARY_FIELDS}) for run in found)
    return RunPage(items, None if last is None else _encode_cursor(*last), tuple(damaged))


def _beyond(column: ColumnElement, descending: bool, after: Place) -> ColumnElement[bool]:
    if column is runs.c.id:
        return column < after[1] if descending else column > after[1]
    here = tuple_(column, runs.c.id)
    return here < after if descending else here > after


def _filtered(query: Select, wanted: RunFilter) -> Select:
    for name in ("kind", "mode", "status", "name", "batch_id", "holds"):
        value = getattr(wanted, name)
        if value is not None:
            query = query.where(runs.c[name] == value)
    if wanted.text is not None:
        query = query.where(runs.c.name.icontains(wanted.text, autoescape=True))
    if wanted.created_after is not None:
        query = query.where(runs.c.created_at > wanted.created_after)
    if wanted.created_before is not None:
        query = query.where(runs.c.created_at < wanted.created_before)
    return query


def _encode_cursor(key: str | float, run_id: str) -> str:
    text = f"1:{run_id}" if key == run_id else "2:" + json.dumps([key, run_id])
    return base64.urlsafe_b64encode(text.encode()).decode().rstrip("=")


def _decode_cursor(cursor: str, order: RunOrder) -> Place:
    """Sort key and id of the last run of the previous page. Raises InvalidCursor, also for a cursor of another
    order."""
    kept = {RunOrder.NAME: str, RunOrder.LEAST: float, RunOrder.GREATEST: float}.get(order)
    try:
        text = base64.b64decode(cursor + "=" * (-len(cursor) % 4), altchars=b"-_", validate=True).decode()
        version, _, rest = text.partition(":")
        key, run_id = (rest, rest) if version == "1" else json.loads(rest)
    except (binascii.Error, ValueError, TypeError) as error:
        raise InvalidCursor("the cursor is not one of this service") from error
    fits = version == ("1" if kept is None else "2") and isinstance(key, kept or str)
    if not fits or not isinstance(run_id, str) or len(run_id) != ID_LENGTH or not run_id.isprintable():
        raise InvalidCursor("the cursor is not one of this service")
    return key, run_id
