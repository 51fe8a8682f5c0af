"""Items of a batch as runs, finished or not: one by its id, and pages of many."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, and_, select

from app.store.batch_inputs import Row, Source, UnreadableRow, unpacked_rows
from app.store.batch_items import name_of, open_run, run_of, unpacked
from app.store.batch_reads import STORED_ITEM, block_of, find_batch, find_item, item_of
from app.store.batch_records import DAMAGED, BatchRecord, ChunkState, Item, ItemStatus, item_id, split_item_id
from app.store.errors import UnknownRun
from app.store.models import batch_chunks, batch_items
from app.store.record import OPEN_STATUSES, RunFilter, RunOrder, RunRecord, RunStatus

Place = tuple[str | float, str]
"""Where a page ends: sort key and id of an item."""

_STATUS_OF = {
    ChunkState.WAITING: RunStatus.QUEUED,
    ChunkState.LEASED: RunStatus.RUNNING,
    ChunkState.CANCELLED: RunStatus.CANCELLED,
}
_UNANSWERED = (*OPEN_STATUSES, RunStatus.CANCELLED)
_ITEMS_OF = {
    RunStatus.SUCCEEDED: (ItemStatus.SUCCEEDED,),
    RunStatus.INFEASIBLE: (ItemStatus.INFEASIBLE,),
    RunStatus.FAILED: (ItemStatus.FAILED, ItemStatus.REFUSED),
}
_BY_FIGURE = (RunOrder.LEAST, RunOrder.GREATEST)
_ROWS, _PLACES = 200, 20_000
"""Items read at once; places in the order of the figures, whose query sorts the whole batch."""
_LONGEST_SEARCH_S = 1.0
"""Names are inside the items' content. A search for them ends a page after this time, well below that of a read."""


def get_item_run(connection: Connection, run_id: str) -> RunRecord:
    """An item, finished or not, as a run record. Raises UnknownRun and DamagedRecord."""
    split = split_item_id(run_id)
    batch = find_batch(connection, split[0]) if split else None
    if split is None or batch is None or split[1] >= batch.total:
        raise UnknownRun(run_id)
    index = split[1]
    item = find_item(connection, batch.number, index)
    return _unanswered_between(connection, batch, index, index)[index].run() if item is None else run_of(batch, item)


def list_item_runs(
    connection: Connection,
    batch: BatchRecord,
    wanted: RunFilter,
    after: Place | None,
    size: int,
    order: RunOrder,
) -> tuple[list[RunRecord], list[str], Place | None]:
    """At most ``size`` items of a batch as runs, in the given order, after ``after``; the ids of damaged ones between
    them; and the place from which the next page goes on, None if no more match. Pages of a search for a name may have
    fewer, even none, before the last one.
    """
    if not _may_match(batch, wanted):
        return [], [], None
    by_figure = order in _BY_FIGURE
    find = _by_figure if by_figure else _by_index
    rows = size + 1 if wanted.name is None and wanted.text is None else _ROWS
    found: list[RunRecord] = []
    damaged: list[str] = []
    end, last = time.monotonic() + _LONGEST_SEARCH_S, after
    for item in find(connection, batch, wanted, after, rows, order):
        if _matches(item, wanted):
            if len(found) + len(damaged) == size:
                return found, damaged, last
            if item.status == DAMAGED:
                damaged.append(item.id)
            else:
                found.append(item.run())
        last = (item.figure if by_figure else item.id), item.id  # type: ignore[assignment]
        if time.monotonic() > end:
            return found, damaged, last
    return found, damaged, None


@dataclass(frozen=True)
class _Answered:
    """A finished item, made a run only if it is wanted: that takes far longer than to read its name."""

    batch: BatchRecord
    item: Item

    @property
    def id(self) -> str:
        return item_id(self.batch.id, self.item.index)

    @property
    def status(self) -> str:
        return self.item.status

    @property
    def figure(self) -> float | None:
        return self.item.figure

    @property
    def name(self) -> str | None:
        return name_of(unpacked(self.item.content, self.batch.dictionary).get("spec"))

    def run(self) -> RunRecord:
        return run_of(self.batch, self.item)


@dataclass(frozen=True)
class _Unanswered:
    """An item without an answer yet, or without one for ever if its batch was cancelled."""

    batch: BatchRecord
    index: int
    status: RunStatus
    body: dict[str, Any]
    figure = None

    @property
    def id(self) -> str:
        return item_id(self.batch.id, self.index)

    @property
    def name(self) -> str | None:
        return name_of(self.body)

    def run(self) -> RunRecord:
        return open_run(self.batch, self.index, self.status, self.body)


_Found = _Answered | _Unanswered


def _may_match(batch: BatchRecord, wanted: RunFilter) -> bool:
    created: datetime = batch.created_at
    return (
        wanted.kind in (None, batch.kind)
        and wanted.mode in (None, batch.mode)
        and (wanted.created_after is None or created > wanted.created_after)
        and (wanted.created_before is None or created < wanted.created_before)
        and (wanted.holds is None or wanted.status not in _UNANSWERED)
    )


def _matches(item: _Found, wanted: RunFilter) -> bool:
    if item.status == DAMAGED or (wanted.name is None and wanted.text is None):
        return True
    name = item.name or ""
    return wanted.name in (None, name) and (wanted.text is None or wanted.text.lower() in name.lower())


def _restricted(query: Select[Any], batch: BatchRecord, wanted: RunFilter) -> Select[Any]:
    query = query.where(batch_items.c.batch == batch.number)
    if wanted.status is not None:
        query = query.where(batch_items.c.status.in_(_ITEMS_OF.get(RunStatus(wanted.status), ())))
    if wanted.holds is not None:
        query = query.where(batch_items.c.holds == wanted.holds)
    return query


def _by_figure(
    connection: Connection, batch: BatchRecord, wanted: RunFilter, after: Place | None, rows: int, order: RunOrder
) -> Iterator[_Found]:
    figure, index = batch_items.c.figure, batch_items.c.index
    down = order is RunOrder.GREATEST
    ends = (figure.desc(), index.desc()) if down else (figure.asc(), index.asc())
    query = _restricted(select(index, figure), batch, wanted).where(figure.is_not(None)).order_by(*ends).limit(_PLACES)
    at = None if after is None else (after[0], _index_of(after))
    while True:
        here = query if at is None else query.where(_beyond(at, down))
        places = [(row.figure, row.index) for row in connection.execute(here).all()]
        for start in range(0, len(places), rows):
            some = [index for _, index in places[start : start + rows]]
            found = _answered(connection, batch, index.in_(some))
            yield from (found[k] for k in some)
        if len(places) < _PLACES:
            return
        at = places[-1]


def _beyond(at: tuple[Any, int], down: bool) -> ColumnElement[bool]:
    figure, index = batch_items.c.figure, batch_items.c.index
    same = and_(figure == at[0], index < at[1] if down else index > at[1])
    return (figure < at[0] if down else figure > at[0]) | same


def _index_of(place: Place) -> int:
    split = split_item_id(place[1])
    return -1 if split is None else split[1]


def _by_index(
    connection: Connection, batch: BatchRecord, wanted: RunFilter, after: Place | None, rows: int, order: RunOrder
) -> Iterator[_Found]:
    down = order is RunOrder.NEWEST
    at = (batch.total if down else -1) if after is None else _index_of(after)
    while True:
        if wanted.status in _UNANSWERED:
            found = _unanswered_page(connection, batch, RunStatus(wanted.status), at, rows, down)
        elif wanted.status is not None or wanted.holds is not None:
            found = _answered_page(connection, batch, wanted, at, rows, down)
        else:
            found = _page(connection, batch, at, rows, down)
        if not found:
            return
        for at in sorted(found, reverse=down):
            yield found[at]


def _answered(connection: Connection, batch: BatchRecord, where: ColumnElement[bool]) -> dict[int, _Found]:
    query = select(*STORED_ITEM).where(batch_items.c.batch == batch.number, where)
    return {row.index: _Answered(batch, item_of(row)) for row in connection.execute(query).all()}


def _answered_page(
    connection: Connection, batch: BatchRecord, wanted: RunFilter, at: int, rows: int, down: bool
) -> dict[int, _Found]:
    index = batch_items.c.index
    query = _restricted(select(*STORED_ITEM), batch, wanted).where(index < at if down else index > at)
    found = connection.execute(query.order_by(index.desc() if down else index.asc()).limit(rows)).all()
    return {row.index: _Answered(batch, item_of(row)) for row in found}


def _page(connection: Connection, batch: BatchRecord, at: int, rows: int, down: bool) -> dict[int, _Found]:
    low, high = (max(0, at - rows), at - 1) if down else (at + 1, min(batch.total - 1, at + rows))
    found = _answered(connection, batch, batch_items.c.index.between(low, high))
    return found if len(found) > high - low else {**_unanswered_between(connection, batch, low, high), **found}


def _unanswered_page(
    connection: Connection, batch: BatchRecord, status: RunStatus, at: int, rows: int, down: bool
) -> dict[int, _Found]:
    """The next ``rows`` items beyond ``at`` in chunks of the given state."""
    state = next(state for state, shown in _STATUS_OF.items() if shown is status)
    first, count = batch_chunks.c.first, batch_chunks.c.count
    there = first < at if down else first + count > at + 1
    query = (
        select(first, count)
        .where(batch_chunks.c.batch == batch.number, batch_chunks.c.state == state, there)
        .order_by(first.desc() if down else first.asc())
        .limit(rows)
    )
    found: dict[int, _Found] = {}
    for start, length in connection.execute(query).all():
        low, high = max(start, 0 if down else at + 1), min(start + length - 1, at - 1 if down else batch.total - 1)
        left = rows - len(found)
        low, high = (max(low, high - left + 1), high) if down else (low, min(high, low + left - 1))
        if left > 0 and low <= high:
            found |= _unanswered_between(connection, batch, low, high)
    return found


def _unanswered_between(connection: Connection, batch: BatchRecord, low: int, high: int) -> dict[int, _Found]:
    """Items with index in [``low``, ``high``] as unanswered, by index."""
    first, count = batch_chunks.c.first, batch_chunks.c.count
    here = batch_chunks.c.batch == batch.number, first <= high, first + count > low
    found: dict[int, _Found] = {}
    blocks: dict[int, bytes] = {}
    for chunk in connection.execute(select(batch_chunks).where(*here)).mappings().all():
        block = chunk["block"]
        blocks[block] = blocks.get(block) or block_of(connection, batch.number, block)
        start, end = max(low, chunk["first"]), min(high + 1, chunk["first"] + chunk["count"])
        rows = unpacked_rows(blocks[block], start - block, end - block)
        found |= {index: _unanswered(batch, chunk, index, row) for index, row in enumerate(rows, start)}
    return found


def _unanswered(batch: BatchRecord, chunk: Any, index: int, row: Row) -> _Unanswered:
    # DONE: the chunk finished after the item query; a repeated query finds the item.
    status = _STATUS_OF.get(ChunkState(chunk["state"]), RunStatus.RUNNING)
    try:
        body = Source.from_json(batch.source).body(row)
    except UnreadableRow:
        body = {}
    return _Unanswered(batch, index, status, body)
