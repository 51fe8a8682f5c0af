"""Write operations on batches, run on a connection within a transaction owned by the writer.

Every state transition of a chunk is conditional on the expected state (compare-and-set): of two processes that both
believe they hold a chunk, one matches no row and changes nothing. The batch row is always locked before its chunks;
this lock order rules out deadlocks.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from datetime import datetime
from functools import lru_cache
from importlib import import_module
from typing import Any

from sqlalchemy import Connection, Dialect, delete, func, insert, select, update

from app.store.batch_items import DIGEST_BYTES, ITEM_COLUMNS, unsealed
from app.store.batch_records import ACTIVE, BatchRecord, BatchStatus, Block, Chunk, ChunkState, ItemStatus
from app.store.errors import IdempotencyConflict
from app.store.idempotency import batch_under, lock_key, run_under
from app.store.leases import expired, now
from app.store.models import batch_blocks, batch_chunks, batch_items, batches, idempotency_keys
from app.store.record import utc_now

_LEAST_PART = 8
"""Factor by which the last chunks of a batch may be smaller than the others."""
RECEIVING_S = 600.0
"""Time [s] after the last block at which an unacknowledged batch counts as abandoned."""
_COLUMNS = [field.name for field in fields(BatchRecord)]


@dataclass(frozen=True)
class Open:
    """Create a batch in the receiving state; returns its number."""

    record: BatchRecord

    def __call__(self, connection: Connection) -> int:
        row = asdict(self.record)
        del row["number"]
        row["received_until"] = now(connection) + RECEIVING_S
        return connection.execute(insert(batches).values(row).returning(batches.c.number)).scalar_one()


@dataclass(frozen=True)
class Receive:
    """Store blocks of a batch, each initially one chunk. False if the batch was dropped meanwhile."""

    number: int
    blocks: tuple[Block, ...]

    def __call__(self, connection: Connection) -> bool:
        kept = update(batches).where(batches.c.number == self.number, batches.c.status == BatchStatus.RECEIVING)
        if not connection.execute(kept.values(received_until=now(connection) + RECEIVING_S)).rowcount:
            return False
        connection.execute(insert(batch_blocks), [_block_row(self.number, block) for block in self.blocks])
        chunks = [Chunk(self.number, block.first, block.count, block.first, 0) for block in self.blocks]
        connection.execute(insert(batch_chunks), [_chunk_row(chunk) for chunk in chunks])
        return True


def _block_row(number: int, block: Block) -> dict[str, Any]:
    return {**asdict(block), "batch": number, "digest": hashlib.sha256(block.content).digest()[:DIGEST_BYTES]}


def _chunk_row(chunk: Chunk) -> dict[str, Any]:
    return {**asdict(chunk), "state": ChunkState.WAITING}


@dataclass(frozen=True)
class Acknowledge:
    """Publish a fully received batch together with the answer to its sender.

    Returns None, or the answer first given under the same idempotency key, in which case this batch is dropped. Raises
    IdempotencyConflict if the key belongs to another request, also to that of a run made after ``since``.
    """

    number: int
    total: int
    key: str | None
    request_hash: str
    answer: bytes
    since: datetime | None = None

    def __call__(self, connection: Connection) -> bytes | None:
        if self.key:
            lock_key(connection, self.key)
            first = find_answer(connection, self.key, self.request_hash, self.since)
            if first is not None:
                _drop(connection, self.number)
                return first
            # an expired one of a run is replaced
            connection.execute(delete(idempotency_keys).where(idempotency_keys.c.key == self.key))
        ended = {"status": BatchStatus.ENDED, "ended_at": utc_now()} if self.total == 0 else {}
        values = {
            "status": BatchStatus.QUEUED,
            "total": self.total,
            "received_until": None,
            "idempotency_key": self.key,
            "request_hash": self.request_hash,
            "answer": self.answer,
            **ended,
        }
        connection.execute(update(batches).where(batches.c.number == self.number).values(values))
        return None


def find_answer(connection: Connection, key: str, request_hash: str, since: datetime | None = None) -> bytes | None:
    """The answer given under the key, or None. Raises IdempotencyConflict if the key belongs to another request, be it
    that of a run made after ``since``."""
    row = batch_under(connection, key)
    if row is None:
        if run_under(connection, key, since) is not None:
            raise IdempotencyConflict(key)
        return None
    if row.request_hash != request_hash:
        raise IdempotencyConflict(key)
    return bytes(row.answer)


@dataclass(frozen=True)
class Drop:
    """Delete an unacknowledged batch."""

    number: int

    def __call__(self, connection: Connection) -> None:
        _drop(connection, self.number)


@dataclass(frozen=True)
class DropAbandoned:
    """Delete batches abandoned by their sender or by a dead process; returns their number."""

    def __call__(self, connection: Connection) -> int:
        query = select(batches.c.number).where(
            batches.c.status == BatchStatus.RECEIVING, batches.c.received_until < now(connection)
        )
        numbers = list(connection.scalars(query))
        for number in numbers:
            _drop(connection, number)
        return len(numbers)


def _drop(connection: Connection, number: int) -> None:
    here = batches.c.number == number, batches.c.status == BatchStatus.RECEIVING
    if connection.execute(select(batches.c.number).where(*here).with_for_update()).first() is None:
        return
    for table in (batch_chunks, batch_blocks):
        connection.execute(delete(table).where(table.c.batch == number))
    connection.execute(delete(batches).where(*here))


@dataclass(frozen=True)
class Claim:
    """Lease up to ``chunks`` chunks of one batch: expired leases first, then waiting chunks in order.

    A chunk of more than ``items``, or of more than the part ``most`` of all that waits, is cut, and the remainder stays
    waiting. So chunks become smaller towards the end of a batch, down to ``items`` / 8, and its workers end together.
    """

    number: int
    owner: str
    lease_s: float
    chunks: int
    items: int
    most: float = 1.0

    def __call__(self, connection: Connection) -> list[Chunk]:
        if not _lock(connection, self.number):
            return []
        time_now = now(connection)
        abandoned = expired(batch_chunks.c.leased_until, time_now)
        found = self._select_chunks(connection, ChunkState.LEASED, self.chunks, abandoned)
        # A waiting row may be cut into several chunks.
        found += self._select_chunks(connection, ChunkState.WAITING, self.chunks - len(found))
        claimed: list[Chunk] = []
        items = self._largest(connection)
        for chunk in found:
            cut = Chunk(chunk.batch, chunk.first, min(items, chunk.count), chunk.block, chunk.attempts + 1)
            _resize(connection, chunk, cut, self.owner, time_now + self.lease_s)
            claimed.append(cut)
        if claimed:
            first = batches.c.number == self.number, batches.c.status == BatchStatus.QUEUED
            connection.execute(update(batches).where(*first).values(status=BatchStatus.RUNNING, started_at=utc_now()))
        return claimed

    def _largest(self, connection: Connection) -> int:
        waits = batch_chunks.c.batch == self.number, batch_chunks.c.state == ChunkState.WAITING
        waiting = connection.execute(select(func.sum(batch_chunks.c.count)).where(*waits)).scalar() or 0
        return min(self.items, max(math.ceil(self.most * waiting), math.ceil(self.items / _LEAST_PART)))

    def _select_chunks(self, connection: Connection, state: ChunkState, most: int, *more: Any) -> list[Chunk]:
        if most <= 0:
            return []
        columns = [batch_chunks.c[field.name] for field in fields(Chunk)]
        query = (
            select(*columns)
            .where(batch_chunks.c.batch == self.number, batch_chunks.c.state == state, *more)
            .order_by(batch_chunks.c.first)
            .limit(most)
            .with_for_update(skip_locked=True)
        )
        return [Chunk(**row) for row in connection.execute(query).mappings().all()]


def _resize(connection: Connection, old: Chunk, new: Chunk, owner: str, leased_until: float) -> None:
    here = batch_chunks.c.batch == old.batch, batch_chunks.c.first == old.first
    values = {
        "count": new.count,
        "state": ChunkState.LEASED,
        "owner": owner,
        "leased_until": leased_until,
        "attempts": new.attempts,
    }
    connection.execute(update(batch_chunks).where(*here).values(values))
    if new.count < old.count:
        rest = Chunk(old.batch, new.end, old.count - new.count, old.block, old.attempts)
        connection.execute(insert(batch_chunks).values(_chunk_row(rest)))


@dataclass(frozen=True)
class Renew:
    """Extend all leases of the owner."""

    owner: str
    lease_s: float

    def __call__(self, connection: Connection) -> None:
        _change_held(connection, self.owner, {"leased_until": now(connection) + self.lease_s})


@dataclass(frozen=True)
class Release:
    """Release all leases of the owner, without counting the attempts."""

    owner: str

    def __call__(self, connection: Connection) -> None:
        values = {"state": ChunkState.WAITING, "owner": None, "attempts": batch_chunks.c.attempts - 1}
        _change_held(connection, self.owner, values)


def _lock(connection: Connection, number: int) -> bool:
    """Lock an active batch, and thereby its chunks, until the transaction ends; False if it is not active."""
    active = batches.c.number == number, batches.c.status.in_(ACTIVE)
    return connection.execute(select(batches.c.number).where(*active).with_for_update()).first() is not None


def _change_held(connection: Connection, owner: str, values: dict[str, Any]) -> None:
    active = select(batches.c.number).where(batches.c.status.in_(ACTIVE)).order_by(batches.c.number)
    for number in connection.scalars(active.with_for_update()).all():
        held = (
            batch_chunks.c.batch == number,
            batch_chunks.c.state == ChunkState.LEASED,
            batch_chunks.c.owner == owner,
        )
        connection.execute(update(batch_chunks).where(*held).values(values))


@dataclass(frozen=True)
class Finish:
    """Atomically store a chunk's answers, ``sealed``, and mark it done. Returns the number of items of each status;
    None, without effect, if the owner lost its lease."""

    chunk: Chunk
    owner: str
    items: bytes

    def __call__(self, connection: Connection) -> Counter[str] | None:
        if not _lock(connection, self.chunk.batch):
            return None
        if not _update_leased(connection, self.chunk, self.owner, {"state": ChunkState.DONE, "leased_until": None}):
            return None
        rows = unsealed(self.items)
        put_items(connection, rows)
        counted = Counter(row[_STATUS] for row in rows)
        here = batches.c.number == self.chunk.batch
        counters = {name: batches.c[name] + count for name, count in counted.items()}
        connection.execute(update(batches).where(here).values(counters))
        done = sum(batches.c[str(status)] for status in ItemStatus)
        ended = {"status": BatchStatus.ENDED, "ended_at": utc_now()}
        connection.execute(update(batches).where(here, done == batches.c.total).values(ended))
        return counted


def _update_leased(connection: Connection, chunk: Chunk, owner: str, values: dict[str, Any]) -> bool:
    mine = (
        batch_chunks.c.batch == chunk.batch,
        batch_chunks.c.first == chunk.first,
        batch_chunks.c.count == chunk.count,
        batch_chunks.c.state == ChunkState.LEASED,
        batch_chunks.c.owner == owner,
    )
    return connection.execute(update(batch_chunks).where(*mine).values(values)).rowcount == 1


_STATUS = ITEM_COLUMNS.index("status")


def put_items(connection: Connection, rows: Sequence[tuple[Any, ...]]) -> None:
    """Insert items, as rows of their table; existing ones are left unchanged."""
    # Every driver accepts these values unchanged; conversion by SQLAlchemy would take longer than the insertion.
    statement, by_name = _insert_items(connection.dialect)
    if rows:
        found: Any = [dict(zip(ITEM_COLUMNS, row, strict=True)) for row in rows] if by_name else rows
        connection.exec_driver_sql(statement, found)


@lru_cache(maxsize=2)
def _insert_items(dialect: Dialect) -> tuple[str, bool]:
    """The statement of ``put_items``, and whether it takes its values by name instead of in order."""
    # Imported by name: each dialect is slow to import, and only one is needed.
    make = import_module(f"sqlalchemy.dialects.{dialect.name}").insert
    compiled = make(batch_items).on_conflict_do_nothing().compile(dialect=dialect, column_keys=ITEM_COLUMNS)
    assert not compiled.positional or tuple(compiled.positiontup or ()) == ITEM_COLUMNS
    return str(compiled), not compiled.positional


@dataclass(frozen=True)
class Split:
    """Return a failed chunk as two halves, to isolate the item that caused the failure."""

    chunk: Chunk
    owner: str

    def __call__(self, connection: Connection) -> bool:
        half = self.chunk.count // 2
        values = {"count": half, "state": ChunkState.WAITING, "owner": None, "attempts": 0}
        if half == 0 or not _lock(connection, self.chunk.batch):
            return False
        if not _update_leased(connection, self.chunk, self.owner, values):
            return False
        chunk = self.chunk
        rest = Chunk(chunk.batch, chunk.first + half, chunk.count - half, chunk.block, 0)
        connection.execute(insert(batch_chunks).values(_chunk_row(rest)))
        return True


@dataclass(frozen=True)
class Return:
    """Return a chunk for a retry; ``in_vain`` counts the attempt."""

    chunk: Chunk
    owner: str
    in_vain: bool

    def __call__(self, connection: Connection) -> bool:
        attempts = self.chunk.attempts - (0 if self.in_vain else 1)
        values = {"state": ChunkState.WAITING, "owner": None, "attempts": attempts}
        return _lock(connection, self.chunk.batch) and _update_leased(connection, self.chunk, self.owner, values)


@dataclass(frozen=True)
class Cancel:
    """Cancel an active batch; finished items are kept. False if it had already ended."""

    number: int

    def __call__(self, connection: Connection) -> bool:
        active = batches.c.number == self.number, batches.c.status.in_(ACTIVE)
        values = {"status": BatchStatus.CANCELLED, "ended_at": utc_now()}
        if not connection.execute(update(batches).where(*active).values(values)).rowcount:
            return False
        undone = batch_chunks.c.batch == self.number, batch_chunks.c.state != ChunkState.DONE
        connection.execute(update(batch_chunks).where(*undone).values(state=ChunkState.CANCELLED))
        return True


def record_of(row: Any) -> BatchRecord:
    return BatchRecord(**{name: row[name] for name in _COLUMNS})


def batch_columns() -> list[Any]:
    """The table columns of a ``BatchRecord``."""
    return [batches.c[name] for name in _COLUMNS]
