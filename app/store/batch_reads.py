"""Read queries on batches and their items; items are returned as run records."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, Row, Select, and_, exists, or_, select
from sqlalchemy.sql.functions import count

from app.store.batch_inputs import Row as SentRow
from app.store.batch_inputs import Source, UnreadableRow, unpacked_rows
from app.store.batch_items import digest, open_run, run_of
from app.store.batch_operations import batch_columns, record_of
from app.store.batch_records import ACTIVE, BatchRecord, BatchStatus, ChunkState, Item, ItemStatus, split_item_id
from app.store.errors import DamagedRecord, UnknownBatch, UnknownRun
from app.store.leases import now
from app.store.models import batch_blocks, batch_chunks, batch_items, batches
from app.store.record import OPEN_STATUSES, RunFilter, RunOrder, RunRecord, RunStatus
from app.store.viewer import viewer

_ITEM = [batch_items.c[name] for name in ("batch", "index", "line", "status", "holds", "figure", "content", "digest")]
_SHOWN = batches.c.status != BatchStatus.RECEIVING
_STATUS_OF = {
    ChunkState.WAITING: RunStatus.QUEUED,
    ChunkState.LEASED: RunStatus.RUNNING,
    ChunkState.CANCELLED: RunStatus.CANCELLED,
}
_ITEMS_OF = {
    RunStatus.SUCCEEDED: (ItemStatus.SUCCEEDED,),
    RunStatus.INFEASIBLE: (ItemStatus.INFEASIBLE,),
    RunStatus.FAILED: (ItemStatus.FAILED, ItemStatus.REFUSED),
}
_MAX_SCANNED = 5000
"""Maximum number of items scanned per page for a filter without an index."""


@dataclass(frozen=True)
class BatchFilter:
    """Conjunction of conditions; None does not restrict."""

    kind: str | None = None
    mode: str | None = None
    status: str | None = None
    name: str | None = None


def find_batch(connection: Connection, batch_id: str) -> BatchRecord | None:
    query = select(*batch_columns()).where(batches.c.id == batch_id, _SHOWN)
    row = connection.execute(query).mappings().first()
    found, who = None if row is None else record_of(row), viewer.get()
    # A batch of another owner is reported as unknown.
    return found if found is not None and (who.everything or found.owner == who.owner) else None


def get_batch(connection: Connection, batch_id: str) -> BatchRecord:
    """The batch with this id. Raises UnknownBatch."""
    found = find_batch(connection, batch_id)
    if found is None:
        raise UnknownBatch(batch_id)
    return found


def list_batches(connection: Connection, wanted: BatchFilter, before: str | None, limit: int) -> list[BatchRecord]:
    """Batches, newest first, older than the id ``before``."""
    query = select(*batch_columns()).where(_SHOWN).order_by(batches.c.id.desc()).limit(limit)
    for name in ("kind", "mode", "status", "name"):
        value = getattr(wanted, name)
        if value is not None:
            query = query.where(batches.c[name] == value)
    if before is not None:
        query = query.where(batches.c.id < before)
    if not viewer.get().everything:
        query = query.where(batches.c.owner == viewer.get().owner)
    return [record_of(row) for row in connection.execute(query).mappings()]


def batches_to_solve(connection: Connection) -> list[tuple[str | None, int]]:
    """Owner and number of each active batch with a chunk that can be leased: waiting, or with an expired lease."""
    expired = and_(batch_chunks.c.state == ChunkState.LEASED, batch_chunks.c.leased_until < now(connection))
    free = or_(batch_chunks.c.state == ChunkState.WAITING, expired)
    query = (
        select(batches.c.owner, batches.c.number)
        .where(batches.c.status.in_(ACTIVE), exists().where(batch_chunks.c.batch == batches.c.number, free))
        .order_by(batches.c.number)
    )
    return [(row.owner, row.number) for row in connection.execute(query)]


def active_batches_of(connection: Connection, owner: str | None) -> int:
    """The number of batches of an owner that have not ended."""
    here = batches.c.status.in_((BatchStatus.RECEIVING, *ACTIVE)), batches.c.owner == owner
    return connection.execute(select(count()).select_from(batches).where(*here)).scalar_one()


def numbered_batch(connection: Connection, number: int) -> BatchRecord:
    """The batch with this number."""
    query = select(*batch_columns()).where(batches.c.number == number)
    return record_of(connection.execute(query).mappings().one())


def block_of(connection: Connection, number: int, first: int) -> bytes:
    """The content of the block whose first item is ``first``."""
    query = select(batch_blocks.c.content).where(batch_blocks.c.batch == number, batch_blocks.c.first == first)
    return bytes(connection.execute(query).scalar_one())


def items_after(
    connection: Connection, number: int, after: int, limit: int, statuses: tuple[str, ...] = ()
) -> list[Item]:
    """Finished items with index > ``after`` in index order; empty ``statuses`` selects all."""
    query = select(*_ITEM).where(batch_items.c.batch == number, batch_items.c.index > after)
    if statuses:
        query = query.where(batch_items.c.status.in_(statuses))
    return [_item(row) for row in connection.execute(query.order_by(batch_items.c.index).limit(limit))]


def items_spread(connection: Connection, number: int, step: int, limit: int) -> list[Item]:
    """Finished items whose index is a multiple of ``step``."""
    index = batch_items.c.index
    query = select(*_ITEM).where(batch_items.c.batch == number, index % step == 0).order_by(index).limit(limit)
    return [_item(row) for row in connection.execute(query)]


def unchecked_items_after(connection: Connection, number: int, after: int, limit: int) -> Iterator[tuple[Item, bool]]:
    """Finished items with index > ``after``, each with whether its digest matches."""
    query = select(*_ITEM).where(batch_items.c.batch == number, batch_items.c.index > after)
    for row in connection.execute(query.order_by(batch_items.c.index).limit(limit)):
        yield _unchecked(row)


def _item(row: Row[Any]) -> Item:
    """The item of a row. Raises DamagedRecord if its digest does not match."""
    found, sound = _unchecked(row)
    if not sound:
        raise DamagedRecord(batch_items.name, f"{row.batch} {row.index}")
    return found


def _unchecked(row: Row[Any]) -> tuple[Item, bool]:
    found = Item(row.index, row.line, row.status, row.holds, row.figure, bytes(row.content))
    return found, digest(row.batch, found) == bytes(row.digest)


def items_asking(connection: Connection, number: int, asked: Collection[int]) -> dict[int, Item]:
    """Finished items with intact digests by request number, restricted to ``asked``."""
    query = select(*_ITEM, batch_items.c.asked).where(batch_items.c.batch == number, batch_items.c.asked.in_(asked))
    found = {row.asked: _unchecked(row) for row in connection.execute(query)}
    return {number: item for number, (item, sound) in found.items() if sound}


def find_item(connection: Connection, number: int, index: int) -> Item | None:
    query = select(*_ITEM).where(batch_items.c.batch == number, batch_items.c.index == index)
    row = connection.execute(query).first()
    return None if row is None else _item(row)


def get_item_run(connection: Connection, run_id: str) -> RunRecord:
    """An item, finished or not, as a run record. Raises UnknownRun."""
    split = split_item_id(run_id)
    batch = find_batch(connection, split[0]) if split else None
    if split is None or batch is None or split[1] >= batch.total:
        raise UnknownRun(run_id)
    item = find_item(connection, batch.number, split[1])
    return _open_run(connection, batch, split[1]) if item is None else run_of(batch, item)


def _open_run(connection: Connection, batch: BatchRecord, index: int) -> RunRecord:
    here = batch_chunks.c.batch == batch.number, batch_chunks.c.first <= index
    query = select(batch_chunks).where(*here).order_by(batch_chunks.c.first.desc()).limit(1)
    chunk = connection.execute(query).mappings().one()
    content = block_of(connection, batch.number, chunk["block"])
    [row] = unpacked_rows(content, index - chunk["block"], index - chunk["block"] + 1)
    return open_run(batch, index, _status(chunk), _body(batch, row))


def _status(chunk: Any) -> RunStatus:
    # DONE: the chunk finished after the item query; a repeated query finds the item.
    return _STATUS_OF.get(ChunkState(chunk["state"]), RunStatus.RUNNING)


def _body(batch: BatchRecord, row: SentRow) -> dict[str, Any]:
    try:
        return Source.from_json(batch.source).body(row)
    except UnreadableRow:
        return {}


def list_item_runs(
    connection: Connection,
    batch: BatchRecord,
    wanted: RunFilter,
    after: tuple[str | float, str] | None,
    size: int,
    order: RunOrder,
) -> tuple[list[RunRecord], bool]:
    """At most ``size`` items of a batch as runs, in the given order, after ``after``; and whether more follow."""
    if not _may_match(batch, wanted):
        return [], False
    if order in (RunOrder.LEAST, RunOrder.GREATEST):
        found = _by_figure(connection, batch, wanted, after, size + 1, order)
    else:
        start = None if after is None else split_item_id(after[1])
        found = _by_index(connection, batch, wanted, None if start is None else start[1], size + 1, order)
    runs = list(found)
    return runs[:size], len(runs) > size


def _may_match(batch: BatchRecord, wanted: RunFilter) -> bool:
    created: datetime = batch.created_at
    return (
        wanted.kind in (None, batch.kind)
        and wanted.mode in (None, batch.mode)
        and (wanted.created_after is None or created > wanted.created_after)
        and (wanted.created_before is None or created < wanted.created_before)
    )


def _matches(run: RunRecord, wanted: RunFilter) -> bool:
    name = run.name or ""
    return wanted.name in (None, name) and (wanted.text is None or wanted.text.casefold() in name.casefold())


def _restricted(query: Select[Any], batch: BatchRecord, wanted: RunFilter) -> Select[Any]:
    query = query.where(batch_items.c.batch == batch.number)
    if wanted.status is not None:
        query = query.where(batch_items.c.status.in_(_ITEMS_OF.get(RunStatus(wanted.status), ())))
    if wanted.holds is not None:
        query = query.where(batch_items.c.holds == wanted.holds)
    return query


def _by_figure(
    connection: Connection,
    batch: BatchRecord,
    wanted: RunFilter,
    after: tuple[str | float, str] | None,
    most: int,
    order: RunOrder,
) -> Iterator[RunRecord]:
    figure, index = batch_items.c.figure, batch_items.c.index
    down = order is RunOrder.GREATEST
    query = _restricted(select(*_ITEM), batch, wanted).where(figure.is_not(None))
    start = None if after is None else split_item_id(after[1])
    if after is not None and start is not None:
        level = after[0]
        beyond = figure < level if down else figure > level
        same = and_(figure == level, index < start[1] if down else index > start[1])
        query = query.where(beyond | same)
    ends = (figure.desc(), index.desc()) if down else (figure.asc(), index.asc())
    for row in connection.execute(query.order_by(*ends).limit(most)):
        run = run_of(batch, _item(row))
        if _matches(run, wanted):
            yield run


def _by_index(
    connection: Connection, batch: BatchRecord, wanted: RunFilter, after: int | None, most: int, order: RunOrder
) -> Iterator[RunRecord]:
    down = order is RunOrder.NEWEST
    at = (batch.total if down else -1) if after is None else after
    left, looked = most, 0
    while left > 0 and looked < _MAX_SCANNED:
        page = max(left, 50)
        if wanted.status in OPEN_STATUSES or wanted.status == RunStatus.CANCELLED:
            found = _open_page(connection, batch, RunStatus(wanted.status), at, page, down)
        elif wanted.status is not None or wanted.holds is not None:
            found = _ended_page(connection, batch, wanted, at, page, down)
        else:
            found = _page(connection, batch, at, page, down)
        if not found:
            return
        for run in found:
            if left > 0 and _matches(run, wanted):
                left -= 1
                yield run
        looked += len(found)
        last = split_item_id(found[-1].id)
        assert last is not None
        at = last[1]


def _ended_page(
    connection: Connection, batch: BatchRecord, wanted: RunFilter, at: int, page: int, down: bool
) -> list[RunRecord]:
    index = batch_items.c.index
    query = _restricted(select(*_ITEM), batch, wanted).where(index < at if down else index > at)
    rows = connection.execute(query.order_by(index.desc() if down else index.asc()).limit(page))
    return [run_of(batch, _item(row)) for row in rows]


def _page(connection: Connection, batch: BatchRecord, at: int, page: int, down: bool) -> list[RunRecord]:
    low, high = (max(0, at - page), at - 1) if down else (at + 1, min(batch.total - 1, at + page))
    index = batch_items.c.index
    query = select(*_ITEM).where(batch_items.c.batch == batch.number, index >= low, index <= high)
    runs = {row.index: run_of(batch, _item(row)) for row in connection.execute(query)}
    if len(runs) < high - low + 1:
        runs = {**_open_between(connection, batch, low, high), **runs}
    return [runs[k] for k in sorted(runs, reverse=down)]


def _open_page(
    connection: Connection, batch: BatchRecord, status: RunStatus, at: int, page: int, down: bool
) -> list[RunRecord]:
    """The next ``page`` items beyond ``at`` in chunks of the given state."""
    state = next(state for state, shown in _STATUS_OF.items() if shown is status)
    first, count = batch_chunks.c.first, batch_chunks.c.count
    there = first < at if down else first + count > at + 1
    query = (
        select(first, count)
        .where(batch_chunks.c.batch == batch.number, batch_chunks.c.state == state, there)
        .order_by(first.desc() if down else first.asc())
        .limit(page)
    )
    runs: list[RunRecord] = []
    for start, length in connection.execute(query).all():
        low, high = max(start, 0 if down else at + 1), min(start + length - 1, at - 1 if down else batch.total - 1)
        wanted = page - len(runs)
        low, high = (max(low, high - wanted + 1), high) if down else (low, min(high, low + wanted - 1))
        if wanted <= 0 or low > high:
            continue
        found = _open_between(connection, batch, low, high)
        runs += [found[k] for k in sorted(found, reverse=down)]
    return runs


def _open_between(connection: Connection, batch: BatchRecord, low: int, high: int) -> dict[int, RunRecord]:
    """Items with index in [``low``, ``high``] as unanswered runs, by index."""
    first, count = batch_chunks.c.first, batch_chunks.c.count
    here = batch_chunks.c.batch == batch.number, first <= high, first + count > low
    runs = {}
    blocks: dict[int, bytes] = {}
    for chunk in connection.execute(select(batch_chunks).where(*here)).mappings().all():
        block = chunk["block"]
        blocks[block] = blocks.get(block) or block_of(connection, batch.number, block)
        start, end = max(low, chunk["first"]), min(high + 1, chunk["first"] + chunk["count"])
        rows = unpacked_rows(blocks[block], start - block, end - block)
        for index, row in enumerate(rows, start):
            runs[index] = open_run(batch, index, _status(chunk), _body(batch, row))
    return runs
