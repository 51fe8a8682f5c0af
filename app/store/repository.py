"""The store as the rest of the service sees it: put, finish, find, list."""

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

from app.store.batch_reads import find_batch, get_item_run, list_item_runs
from app.store.batch_records import BatchRecord
from app.store.engine import make_engine
from app.store.errors import DamagedRecord, InvalidCursor, UnknownRun
from app.store.faults import FileWatch, StoreFault, Trouble, told
from app.store.models import runs
from app.store.operations import Advance, Put, PutOnce, find_response
from app.store.promises import Promise
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
from app.store.upkeep import Expire, Probe
from app.store.viewer import Viewer, own_key, viewer
from app.store.writer import GroupWriter, Operation

T = TypeVar("T")

MAX_PAGE = 200
"""The most runs that one page of the listing holds."""

RECENT = 20_000
"""How many specs back a repeated one is recognised."""

DEADLINE_S = 5.0
"""So long a read may take with its wait for a thread."""
PROBE_S = 2.0
"""So often readiness tries a write, however often it is asked."""

Seen = Callable[[float, StoreFault | None], None]


def nobody(_seconds: float, _fault: StoreFault | None) -> None:
    """Hears nothing."""


READERS = 4
ID_LENGTH = 36
"""Threads for reads; each holds at most one connection."""


class RunStore:
    """Durable runs in one database, migrated beforehand with ``app.store.migrate.upgrade``.

    Every ``await`` on a write returns after the commit is durable. Writes of one store go through one thread
    and share commits; reads run on a few threads beside it. ``close`` commits what waits.
    """

    def __init__(
        self, url: str, write_capacity: int = 4096, keys_kept: timedelta | None = None, seen: Seen = nobody
    ) -> None:
        """``keys_kept`` is how long idempotency keys are good, None for ever; ``seen`` hears what each group of writes
        took, and what was wrong with it."""
        self._engine = make_engine(url)
        with told():
            self._engine.connect().close()
        self._watch = FileWatch(self._engine.url)
        self._kept, self._hears = keys_kept, seen
        self._fault: StoreFault | None = None
        self._probed = -PROBE_S
        self._writer = GroupWriter(self._engine, write_capacity, check=self._watch.check, seen=self._written)
        self._readers = ThreadPoolExecutor(READERS, thread_name_prefix="store-reader")
        self._recent = RecentSpecs(RECENT)
        self._recent.fill(reversed(self.read(_newest_specs)))

    # -- writes ---------------------------------------------------------------------------------------------

    async def put(self, record: RunRecord, response: StoredResponse | None = None) -> StoredResponse | None:
        """Insert a run, with the answer to keep under its idempotency key if it has one.

        Returns None once the run is durable. Where an earlier or simultaneous request with the same key and
        body was first, nothing is inserted and that request's answer is returned; with another body,
        IdempotencyConflict is raised.
        """
        first = await self._writer.submit(_insertion(record, response, self._since()))
        self._recent.add(record.spec_hash)
        return first

    async def promise(
        self, record: RunRecord, response: StoredResponse | None, owner: str, lease_s: float
    ) -> StoredResponse | None:
        """``put`` of an open run that ``owner`` works on: see ``app.store.promises``."""
        first = await self._writer.submit(Promise(_insertion(record, response, self._since()), owner, lease_s))
        self._recent.add(record.spec_hash)
        return first

    def put_and_wait(self, record: RunRecord, response: StoredResponse | None = None) -> StoredResponse | None:
        """``put`` for code without an event loop (the command line)."""
        first = self._writer.submit_and_wait(_insertion(record, response, self._since()))
        self._recent.add(record.spec_hash)
        return first

    async def start(self, run_id: str) -> bool:
        """Queued → running. False if the run had ended already (cancelled, say)."""
        return await self._writer.submit(Advance(run_id, None))

    async def finish(self, run_id: str, end: Finish) -> bool:
        """Queued or running → its end, in one transaction. False, and no change, if the run had ended already."""
        return await self._writer.submit(Advance(run_id, end))

    async def write(self, operation: Operation) -> Any:
        """Run an operation of this package and wait for its commit."""
        return await self._writer.submit(operation)

    def write_and_wait(self, operation: Operation) -> Any:
        """The same for code without an event loop."""
        return self._writer.submit_and_wait(operation)

    # -- reads ----------------------------------------------------------------------------------------------

    async def get(self, run_id: str) -> RunRecord:
        """The run, or UnknownRun, also where the viewer must not see it."""
        who = viewer.get()
        record = await self._read(lambda connection: _get(connection, run_id))
        if not who.everything and record.owner != who.owner:
            raise UnknownRun(run_id)
        return record

    async def find_response(self, key: str, request_hash: str) -> StoredResponse | None:
        """The answer kept under an idempotency key, None if the key is new, IdempotencyConflict if it is another's."""
        own = own_key(key)
        return await self._read(lambda connection: find_response(connection, own, request_hash, self._since()))

    async def find_answer(self, spec_hash: str, solver_name: str, solver_version: str) -> RunRecord | None:
        """The newest undamaged run that this very solver answered (succeeded or infeasible) for the same spec.

        Only the ``RECENT`` newest specs are looked for, and only among the viewer's own runs.
        """
        if spec_hash not in self._recent:
            return None
        solver, owner = (solver_name, solver_version), viewer.get().owner
        return await self._read(lambda connection: _find_answer(connection, spec_hash, solver, owner))

    async def list_runs(
        self,
        wanted: RunFilter,
        cursor: str | None = None,
        limit: int = 50,
        order: RunOrder = RunOrder.NEWEST,
    ) -> RunPage:
        """A page of runs in that order. Runs that arrive between two pages shift nothing; limit is 1…200.

        The items of a batch are listed where the filter names it, else only what was asked for by itself.
        Raises InvalidCursor for a cursor that no page of this store carried.
        """
        after = _decode_cursor(cursor, order) if cursor is not None else None
        size = max(1, min(limit, MAX_PAGE))
        who = viewer.get()
        return await self._read(lambda connection: _list(connection, wanted, after, size, order, who))

    async def ping(self) -> None:
        """Raise StoreFault unless the database answers, holds the tables, takes writes and is not known to be damaged.

        A write is tried every few seconds, and each time while the last one failed.
        """
        fault = self._fault
        if fault is not None and fault.trouble is Trouble.DAMAGED:
            raise fault
        if fault is not None or time.monotonic() - self._probed >= PROBE_S:
            await self._writer.submit(Probe())
            self._probed = time.monotonic()
        await self._read(lambda connection: connection.execute(select(runs.c.id).limit(1)).first())

    async def expire_keys(self) -> int:
        """Delete idempotency keys that are good no longer; how many."""
        since, deleted = self._since(), 0
        while since is not None and (count := await self._writer.submit(Expire(since))):
            deleted += count
        return deleted

    def _since(self) -> datetime | None:
        """From when on runs' idempotency keys are good; None: from the first."""
        return None if self._kept is None else utc_now() - self._kept

    def _written(self, seconds: float, fault: StoreFault | None) -> None:
        self._note(fault)
        self._hears(seconds, fault)

    def _note(self, fault: StoreFault | None) -> None:
        """Keep what is wrong until a write succeeds; damage does not heal."""
        if self._fault is None or self._fault.trouble is not Trouble.DAMAGED:
            self._fault = fault

    # -- life -----------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Commit everything that waits, then let go of the database."""
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
        """``read`` on one of the threads for reads."""
        return await self._reading(query)

    def _reading(self, query: Callable[[Connection], T]) -> asyncio.Future[T]:
        # The thread looks with the eyes of whoever asks.
        context = contextvars.copy_context()
        return asyncio.get_running_loop().run_in_executor(self._readers, context.run, self.read, query)

    async def _read(self, query: Callable[[Connection], T]) -> T:
        try:
            return await asyncio.wait_for(self._reading(query), DEADLINE_S)
        except TimeoutError:
            raise StoreFault(Trouble.BUSY, "reads wait too long") from None

    def read(self, query: Callable[[Connection], T]) -> T:
        """Run a query of this package on a connection of its own. Raises StoreFault."""
        self._watch.check()
        try:
            with told(), self._engine.connect() as connection:
                return query(connection)
        except StoreFault as fault:
            if fault.trouble is Trouble.DAMAGED:
                self._note(fault)
            raise


def _insertion(record: RunRecord, response: StoredResponse | None, since: datetime | None) -> Put | PutOnce:
    if response is None:
        return Put(record)
    return PutOnce(record, replace(response, key=own_key(response.key)), since)


def _get(connection: Connection, run_id: str) -> RunRecord:
    # What is no id is not asked for: not every database bears every character.
    known = len(run_id) == ID_LENGTH and run_id.isprintable()
    try:
        row = connection.execute(select(runs).where(runs.c.id == run_id)).mappings().first() if known else None
    except (ValueError, TypeError, AttributeError) as error:  # a time that is no time any more
        raise DamagedRecord(runs.name, run_id) from error
    if not known:
        raise UnknownRun(run_id)
    return get_item_run(connection, run_id) if row is None else row_to_run(row)


def _newest_specs(connection: Connection) -> list[str]:
    return list(connection.scalars(select(runs.c.spec_hash).order_by(runs.c.id.desc()).limit(RECENT)))


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
    # A damaged row must not spread into new answers.
    return row_to_run(row) if row is not None and is_intact(runs.name, row) else None


_KEYS = {
    RunOrder.NEWEST: (runs.c.id, True),
    RunOrder.OLDEST: (runs.c.id, False),
    RunOrder.NAME: (runs.c.name, False),
    RunOrder.LEAST: (runs.c.figure, False),
    RunOrder.GREATEST: (runs.c.figure, True),
}
"""By which column each order sorts, and whether downward; the id decides between equals."""


def _list(
    connection: Connection,
    wanted: RunFilter,
    after: tuple[str | float, str] | None,
    size: int,
    order: RunOrder,
    who: Viewer,
) -> RunPage:
    batch = None if wanted.batch_id is None else find_batch(connection, wanted.batch_id)
    if batch is not None:
        return _list_batch(connection, batch, wanted, after, size, order)
    column, downward = _KEYS[order]
    query = _filtered(select(runs), wanted)
    if not who.everything:
        query = query.where(runs.c.owner == who.owner)
    if column is not runs.c.id:
        query = query.where(column.is_not(None))
    if after is not None:
        query = query.where(_beyond(column, downward, after))
    ends = (runs.c.id,) if column is runs.c.id else (column, runs.c.id)
    query = query.order_by(*(end.desc() if downward else end.asc() for end in ends))
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
    after: tuple[str | float, str] | None,
    size: int,
    order: RunOrder,
) -> RunPage:
    found, more = list_item_runs(connection, batch, wanted, after, size, order)
    items = tuple(RunSummary(**{name: getattr(run, name) for name in SUMMARY_FIELDS}) for run in found)
    if not more:
        return RunPage(items, None)
    last = items[-1]
    keys = {RunOrder.NAME: last.name or "", RunOrder.LEAST: last.figure, RunOrder.GREATEST: last.figure}
    return RunPage(items, _encode_cursor(keys.get(order, last.id), last.id))


def _beyond(column: ColumnElement, downward: bool, after: tuple[str | float, str]) -> ColumnElement[bool]:
    if column is runs.c.id:
        return column < after[1] if downward else column > after[1]
    here = tuple_(column, runs.c.id)
    return here < after if downward else here > after


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


def _decode_cursor(cursor: str, order: RunOrder) -> tuple[str | float, str]:
    """The key and the id of the last run of the page before. Raises InvalidCursor for one of another order too."""
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
