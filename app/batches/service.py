"""Batch service used by the API and the pages: submit, show, cancel and export batches."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import re
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from app.batches.engine import BatchEngine
from app.batches.fields import MOST_COLUMNS, texts, unknown
from app.batches.fields import names as field_names
from app.batches.intake import Receiver, aside, in_slices
from app.batches.parquet import ParquetTable
from app.batches.results import Format, Wanted, streamed
from app.batches.splitting import Lines, Records, header_of
from app.batches.sweep import Sweep
from app.batches.view import batch_json
from app.designs.kind import Mode
from app.designs.problems import INVALID
from app.designs.refusals import with_suggestion
from app.designs.registry import KINDS, modes_of
from app.designs.schema import entry
from app.errors import Problem
from app.jobs.errors import ShareUsed
from app.jobs.executor import Executor
from app.names import cleaned
from app.store.batch_inputs import Row, Source, UnreadableRow
from app.store.batch_operations import Acknowledge, Cancel, Drop, Open, find_answer
from app.store.batch_reads import BatchFilter, active_batches_of, get_batch, list_batches
from app.store.batch_records import BatchRecord, BatchStatus, new_batch_id
from app.store.errors import InvalidCursor
from app.store.hashing import canonical_json
from app.store.idempotency import is_used
from app.store.leases import LEASE_S
from app.store.record import utc_now
from app.store.repository import RunStore
from app.store.viewer import own_key, viewer
from app.version import NAME, VERSION

MOST_ITEMS, MOST_OPEN = 10_000_000, 200
_POLL_INTERVAL_S, _RETRY_S = 0.5, 5.0
_MAX_PAGE_SIZE = 200
_ID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")


class BatchService:
    """The batches of one store and the engine that processes them."""

    def __init__(
        self,
        store: RunStore,
        executor: Executor,
        solve_budget_s: float,
        lease_s: float = LEASE_S,
        most_items: int = MOST_ITEMS,
        most_open: int = MOST_OPEN,
    ) -> None:
        self.store = store
        self.engine = BatchEngine(store, executor, solve_budget_s, lease_s)
        self._most_items, self._most_open = most_items, most_open
        self._writing = asyncio.Lock()

    def start(self) -> None:
        self.engine.start()

    async def close(self) -> None:
        await self.engine.close()

    # -- intake ----------------------------------------------------------------------------------------------

    async def take_lines(
        self, ask: Asked, as_csv: bool, stream: AsyncIterator[bytes], key: str | None, digest: Any = None
    ) -> bytes:
        """Accept a batch of NDJSON lines or CSV records, stored while streaming; answers once all are durable."""
        digest = digest or hashlib.sha256()
        digest.update(ask.told())
        lines = Records() if as_csv else Lines()
        parts = _hashed(stream, digest)
        source = Source("ndjson")
        head: list[Row] = []
        if as_csv:
            header, head = await _first_row(lines, parts)
            source = table_source(ask, *_header(header))

        async def rows() -> AsyncIterator[list[Row]]:
            if head:
                yield head
            async for part in parts:
                if found := await aside(lambda part=part: list(lines.feed(part))):
                    yield found
            if last := await aside(lambda: list(lines.end())):
                yield last

        return await self._take(ask, source, rows(), key, digest)

    async def take_sweep(self, sweep: Sweep, key: str | None, digest: Any) -> bytes:
        """Accept a sweep, which the service expands."""
        ask = Asked.of(sweep.kind, sweep.mode, sweep.name, sweep.detail)
        names = tuple(sweep.vary)
        _check_columns(ask, names, "/vary")
        if sweep.total > self._most_items:
            raise self._too_many()
        source = Source("cells", names, base=sweep.base, varied=names)
        return await self._take(ask, source, in_slices(sweep.rows()), key, digest)

    async def take_parquet(self, ask: Asked, file: Path | IO[bytes], key: str | None, digest: Any) -> bytes:
        """Accept a batch from a Parquet file. Raises Problem if it cannot be read as one."""
        digest.update(ask.told())
        table = await asyncio.to_thread(ParquetTable, file)
        source = table_source(ask, table.names)
        return await self._take(ask, source, in_slices(table.rows()), key, digest)

    async def _take(
        self, ask: Asked, source: Source, rows: AsyncIterator[list[Row]], key: str | None, digest: Any
    ) -> bytes:
        own = own_key(key) if key else None
        # Only a batch that is new needs a share; what comes under a known key is answered as before, or refused.
        if own is None or not await self._is_used(own):
            await self._check_share()
        some = await anext(rows, [])
        record = await self._record(ask, source, some[0] if some else None)
        number = await self.store.write(Open(record))
        kept = False
        try:
            receiver = Receiver(self.store, number, self._writing)
            while some:
                await receiver.add(some)
                if receiver.total > self._most_items:
                    raise self._too_many()
                some = await anext(rows, [])
            await receiver.finish()
            if not receiver.total:
                raise Problem(422, INVALID, "there is no row", [entry("", "there is no row", "one row at least")])
            shown = batch_json(_acknowledged(record, receiver.total))
            answer = json.dumps(shown, separators=(",", ":"), ensure_ascii=False).encode()
            since = self.store.keys_valid_since
            first = await self.store.write(Acknowledge(number, receiver.total, own, digest.hexdigest(), answer, since))
            kept = True
        finally:
            if not kept:
                with contextlib.suppress(Exception):
                    await asyncio.shield(self.store.write(Drop(number)))
        self.engine.look()
        return first or answer

    async def first_answer(self, key: str, request_hash: str) -> bytes | None:
        """The answer first given under an idempotency key, or None. Raises IdempotencyConflict."""
        own, since = own_key(key), self.store.keys_valid_since
        return await self.store.query(lambda connection: find_answer(connection, own, request_hash, since))

    async def _is_used(self, own: str) -> bool:
        since = self.store.keys_valid_since
        return await self.store.query(lambda connection: is_used(connection, own, since))

    async def _record(self, ask: Asked, source: Source, first: Row | None) -> BatchRecord:
        return BatchRecord(
            id=new_batch_id(),
            kind=ask.kind,
            mode=ask.mode,
            name=cleaned(ask.name) or None,
            detail=ask.detail,
            status=BatchStatus.RECEIVING,
            source=source.to_json(),
            dictionary=await self.engine.dictionary(ask.kind, ask.mode, ask.detail, source, first),
            solver_name=NAME,
            solver_version=VERSION,
            created_at=utc_now(),
            owner=viewer.get().owner,
        )

    async def _check_share(self) -> None:
        """Raise ShareUsed if the owner has too many batches that have not ended."""
        owner = viewer.get().owner
        number = await self.store.query(lambda connection: active_batches_of(connection, owner))
        if number >= self._most_open:
            raise ShareUsed(f"{number} of your batches have not ended", _RETRY_S)

    def _too_many(self) -> Problem:
        return Problem(413, "The batch is too large", f"at most {self._most_items} items are accepted")

    # -- queries --------------------------------------------------------------------------------------------

    async def get(self, batch_id: str) -> BatchRecord:
        """The batch with this id. Raises UnknownBatch."""
        return await self.store.query(lambda connection: get_batch(connection, batch_id))

    async def list(
        self, wanted: BatchFilter, before: str | None = None, limit: int = 50
    ) -> tuple[list[BatchRecord], str | None]:
        """A page of batches, newest first, and the id to continue from (None on the last page). Raises
        InvalidCursor."""
        if before is not None and not _ID.fullmatch(before):
            raise InvalidCursor("the cursor is not one of this service")
        size = max(1, min(limit, _MAX_PAGE_SIZE))
        found = await self.store.query(lambda connection: list_batches(connection, wanted, before, size + 1))
        return found[:size], found[size - 1].id if len(found) > size else None

    def results(self, batch: BatchRecord, wanted: Wanted, form: Format) -> AsyncIterator[bytes]:
        """The result table of the items finished so far, streamed."""
        return streamed(self.store, batch, wanted, form)

    async def progress(self, batch_id: str, stopping: Callable[[], bool]) -> AsyncIterator[BatchRecord]:
        """Yield the batch after each change, polled twice a second, until it ends or ``stopping()`` is true."""
        last = None
        while not stopping():
            batch = await self.get(batch_id)
            if batch != last:
                yield batch
            last = batch
            if batch.status in (BatchStatus.ENDED, BatchStatus.CANCELLED):
                return
            await asyncio.sleep(_POLL_INTERVAL_S)

    async def cancel(self, batch_id: str) -> BatchRecord:
        """Cancel an active batch; finished items are kept. Raises UnknownBatch, or Problem if it has ended."""
        batch = await self.get(batch_id)
        if not await self.store.write(Cancel(batch.number)):
            status = (await self.get(batch_id)).status
            raise Problem(409, "The batch has ended", f"the batch is {status}; what has ended cannot be cancelled")
        self.engine.cancel(batch.number)
        return await self.get(batch_id)


class Asked:
    """Parameters common to all rows of a batch: kind, mode, batch name, detail."""

    def __init__(self, kind: str, mode: str, name: str = "", detail: str = "scalars") -> None:
        self.kind, self.mode, self.name, self.detail = kind, mode, name, detail

    @classmethod
    def of(cls, kind: str, mode: str, name: str = "", detail: str = "scalars") -> Asked:
        """Validated parameters. Raises Problem for an unknown kind or mode."""
        if kind not in KINDS:
            found = entry("/kind", "is none of the kinds", ", ".join(KINDS))
            raise Problem(422, INVALID, "there is no such kind", [found])
        modes = [str(each) for each in modes_of(KINDS[kind])]
        if mode not in modes:
            found = entry("/mode", f"is no mode of {kind}", ", ".join(modes))
            raise Problem(422, INVALID, "there is no such mode", [found])
        return cls(kind, str(Mode(mode)), name, detail)

    def told(self) -> bytes:
        """Canonical JSON of the parameters, hashed to recognise a repeated request."""
        return canonical_json([self.kind, self.mode, self.name, self.detail])


_A_FIELD = "a dotted field of the request, such as geometry.outer_diameter_mm"


def table_source(ask: Asked, names: tuple[str, ...], delimiter: str = "") -> Source:
    """The source description of a table, a CSV if it has a delimiter. Raises Problem for a column that is not a
    field."""
    if "" in names:
        nameless = entry("", f"has no name for column {names.index('') + 1}", _A_FIELD)
        raise Problem(422, INVALID, "the columns do not fit", [nameless])
    _check_columns(ask, names, "")
    texts_of = texts(ask.kind, ask.mode, names)
    if not delimiter:
        return Source("cells", names, texts_of, varied=names)
    return Source("csv", names, texts_of, varied=names, delimiter=delimiter)


def _check_columns(ask: Asked, names: tuple[str, ...], at: str) -> None:
    found = []
    if len(names) > MOST_COLUMNS:
        found = [entry(at, f"has {len(names)} columns", f"at most {MOST_COLUMNS}")]
    elif len(set(names)) < len(names):
        twice = sorted({name for name in names if names.count(name) > 1})[:20]
        found = [entry(f"{at}/{name[:200]}", "appears more than once", "each column once") for name in twice]
    elif within := [(name, whole) for name in names for whole in _wholes(name) if whole in names][:20]:
        found = [
            entry(f"{at}/{name[:200]}", f"is a part of the column {whole[:200]}", "a field, or its parts, each once")
            for name, whole in within
        ]
    else:
        strange = unknown(ask.kind, ask.mode, names)[:20]
        known = field_names(ask.kind, ask.mode)
        why = "is no field of this kind and mode"
        found = [entry(f"{at}/{name[:200]}", with_suggestion(why, name, known), _A_FIELD) for name in strange]
    if found:
        raise Problem(422, INVALID, "the columns do not fit", found)


def _wholes(name: str) -> list[str]:
    """The fields that contain the one with a dotted name."""
    return [name[:k] for k, letter in enumerate(name) if letter == "."]


def _header(row: Row | None) -> tuple[tuple[str, ...], str]:
    try:
        if row is None:
            raise UnreadableRow("has no header", "a first line of dotted field names")
        return header_of(row)
    except UnreadableRow as error:
        wrong = entry("", str(error), error.allowed)
        raise Problem(422, INVALID, "the header cannot be read", [wrong]) from None


async def _first_row(lines: Lines, parts: AsyncIterator[bytes]) -> tuple[Row | None, list[Row]]:
    """The first row of a stream, and the rows received in the same part."""
    async for part in parts:
        if rows := await aside(lambda part=part: list(lines.feed(part))):
            return rows[0], rows[1:]
    rows = await aside(lambda: list(lines.end()))
    return (rows[0], rows[1:]) if rows else (None, [])


async def _hashed(stream: AsyncIterator[bytes], digest: Any) -> AsyncIterator[bytes]:
    async for part in stream:
        digest.update(part)
        # Bounded pieces: a large part must not block the event loop for other requests.
        for start in range(0, len(part), 65_536):
            yield part[start : start + 65_536]


def _acknowledged(record: BatchRecord, total: int) -> BatchRecord:
    return replace(record, total=total, status=BatchStatus.QUEUED)
