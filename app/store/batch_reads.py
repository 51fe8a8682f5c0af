"""Read queries on batches and their items."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Row, and_, exists, func, or_, select
from sqlalchemy.sql.functions import count

from app.logging import get_logger
from app.store.batch_items import digest
from app.store.batch_operations import batch_columns, record_of
from app.store.batch_records import ACTIVE, DAMAGED, BatchRecord, BatchStatus, ChunkState, Item
from app.store.errors import DamagedRecord, UnknownBatch
from app.store.leases import expired, now
from app.store.models import batch_blocks, batch_chunks, batch_items, batches
from app.store.viewer import viewer

logger = get_logger(__name__)

STORED_ITEM = [
    batch_items.c[name] for name in ("batch", "index", "line", "status", "holds", "figure", "content", "digest")
]
"""The columns that ``item_of`` reads."""
_SHOWN = batches.c.status != BatchStatus.RECEIVING


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
    return [record_of(row) for row in connection.execute(query).mappings().all()]


def batches_to_solve(connection: Connection) -> list[tuple[str | None, int]]:
    """Owner and number of each active batch with a chunk that can be leased: waiting, or with an expired lease."""
    abandoned = and_(batch_chunks.c.state == ChunkState.LEASED, expired(batch_chunks.c.leased_until, now(connection)))
    free = or_(batch_chunks.c.state == ChunkState.WAITING, abandoned)
    query = (
        select(batches.c.owner, batches.c.number)
        .where(batches.c.status.in_(ACTIVE), exists().where(batch_chunks.c.batch == batches.c.number, free))
        .order_by(batches.c.number)
    )
    return [(row.owner, row.number) for row in connection.execute(query).all()]


def open_items(connection: Connection) -> int:
    """The number of items without an answer in all batches that have not ended."""
    left = batches.c.total - batches.c.succeeded - batches.c.infeasible - batches.c.failed - batches.c.refused
    return connection.execute(select(func.sum(left)).where(batches.c.status.in_(ACTIVE))).scalar_one() or 0


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
    """Finished items with index > ``after`` in index order, damaged ones as ``item_of`` has them; empty ``statuses``
    selects all."""
    query = select(*STORED_ITEM).where(batch_items.c.batch == number, batch_items.c.index > after)
    if statuses:
        query = query.where(batch_items.c.status.in_(statuses))
    return [item_of(row) for row in connection.execute(query.order_by(batch_items.c.index).limit(limit)).all()]


def items_spread(connection: Connection, number: int, step: int, limit: int) -> list[Item]:
    """Finished items whose index is a multiple of ``step``, damaged ones as ``item_of`` has them."""
    index = batch_items.c.index
    query = select(*STORED_ITEM).where(batch_items.c.batch == number, index % step == 0).order_by(index).limit(limit)
    return [item_of(row) for row in connection.execute(query).all()]


def unchecked_items_after(connection: Connection, number: int, after: int, limit: int) -> list[tuple[Item, bool]]:
    """Finished items with index > ``after``, each with whether its digest matches."""
    query = select(*STORED_ITEM).where(batch_items.c.batch == number, batch_items.c.index > after)
    return [_unchecked(row) for row in connection.execute(query.order_by(batch_items.c.index).limit(limit)).all()]


def item_of(row: Row[Any]) -> Item:
    """The item of a row. Of one that does not match its digest only the place is known, index and figure; its status is
    ``DAMAGED``."""
    found, sound = _unchecked(row)
    if sound:
        return found
    logger.error("record_damaged", table=batch_items.name, key=_key(row))
    return Item(row.index, None, DAMAGED, None, row.figure, b"")


def _key(row: Row[Any]) -> str:
    return f"{row.batch} {row.index}"


def _unchecked(row: Row[Any]) -> tuple[Item, bool]:
    found = Item(row.index, row.line, row.status, row.holds, row.figure, bytes(row.content))
    return found, digest(row.batch, found) == bytes(row.digest)


def items_asking(connection: Connection, number: int, asked: Collection[int]) -> dict[int, Item]:
    """Finished items with intact digests by request number, restricted to ``asked``."""
    query = select(*STORED_ITEM, batch_items.c.asked).where(
        batch_items.c.batch == number, batch_items.c.asked.in_(asked)
    )
    found = {row.asked: _unchecked(row) for row in connection.execute(query).all()}
    return {number: item for number, (item, sound) in found.items() if sound}


def find_item(connection: Connection, number: int, index: int) -> Item | None:
    """The finished item with this index, None if there is none. Raises DamagedRecord."""
    query = select(*STORED_ITEM).where(batch_items.c.batch == number, batch_items.c.index == index)
    row = connection.execute(query).first()
    if row is None:
        return None
    found, sound = _unchecked(row)
    if not sound:
        raise DamagedRecord(batch_items.name, _key(row))
    return found
