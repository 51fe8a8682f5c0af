"""Integrity check of batches: block and item digests, items present exactly for finished chunks, recounted counters."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Generator, Iterator

from sqlalchemy import Connection, select

from app.store.batch_inputs import unpacked_rows
from app.store.batch_items import DIGEST_BYTES, unpacked
from app.store.batch_operations import batch_columns, record_of
from app.store.batch_reads import unchecked_items_after
from app.store.batch_records import BatchRecord, BatchStatus, ChunkState, ItemStatus
from app.store.damage import Damage
from app.store.models import batch_blocks, batch_chunks, batch_items, batches

_PAGE = 500


def batch_damages(connection: Connection) -> Iterator[Damage | int]:
    """Yield every damage found, interleaved with numbers of items read since the last one (for progress).

    Of a batch still being received only the blocks are checked: nothing of it was acknowledged.
    """
    for row in connection.execute(select(*batch_columns()).order_by(batches.c.number)).mappings().all():
        try:
            batch = record_of(row)
            yield from _blocks(connection, batch)
            if batch.status != BatchStatus.RECEIVING:
                done = yield from _chunks(connection, batch)
                yield from _items(connection, batch, done)
        except Exception as error:
            yield Damage(batches.name, str(row["id"]), f"cannot be read: {error}")


def _blocks(connection: Connection, batch: BatchRecord) -> Iterator[Damage]:
    query = select(batch_blocks).where(batch_blocks.c.batch == batch.number).order_by(batch_blocks.c.first)
    end = 0
    for block in connection.execute(query).mappings():
        key = f"{batch.id} {block['first']}"
        content = bytes(block["content"])
        if hashlib.sha256(content).digest()[:DIGEST_BYTES] != bytes(block["digest"]):
            yield Damage(batch_blocks.name, key, "the content does not agree with its hash")
        elif block["first"] != end or len(unpacked_rows(content)) != block["count"]:
            yield Damage(batch_blocks.name, key, "the block does not follow the one before")
        end = block["first"] + block["count"]
    if batch.status != BatchStatus.RECEIVING and end != batch.total:
        yield Damage(batches.name, batch.id, f"{batch.total} items were acknowledged, {end} are there")


def _chunks(connection: Connection, batch: BatchRecord) -> Generator[Damage, None, list[range]]:
    """Check the chunks; the generator returns the ranges of finished ones."""
    query = select(batch_chunks).where(batch_chunks.c.batch == batch.number).order_by(batch_chunks.c.first)
    end, done = 0, []
    for chunk in connection.execute(query).mappings():
        if chunk["first"] != end:
            yield Damage(batch_chunks.name, f"{batch.id} {chunk['first']}", "the chunk does not follow the one before")
        end = chunk["first"] + chunk["count"]
        if chunk["state"] == ChunkState.DONE:
            done.append(range(chunk["first"], end))
    if end != batch.total:
        yield Damage(batches.name, batch.id, f"chunks end at {end} of {batch.total} items")
    return done


def _items(connection: Connection, batch: BatchRecord, done: list[range]) -> Iterator[Damage | int]:
    counted: Counter[str] = Counter()
    expected = _beyond(done, -1)
    after = -1
    while page := unchecked_items_after(connection, batch.number, after, _PAGE):
        for item, sound in page:
            key = f"{batch.id} {item.index}"
            if next(expected, None) != item.index:
                yield Damage(batch_items.name, key, "the item is not where its chunk says")
                expected = _beyond(done, item.index)
            if not sound:
                yield Damage(batch_items.name, key, "the content does not agree with its hash")
            else:
                unpacked(item.content, batch.dictionary)
            counted[item.status] += 1
        yield len(page)
        after = page[-1][0].index
    missing = sum(1 for _ in expected)
    if missing:
        yield Damage(batch_items.name, batch.id, f"{missing} items of chunks that are done are missing")
    told = {str(status): getattr(batch, str(status)) for status in ItemStatus if getattr(batch, str(status))}
    if dict(counted) != told:
        yield Damage(batches.name, batch.id, f"the counters say {told}, the items {dict(counted)}")


def _beyond(done: list[range], after: int) -> Iterator[int]:
    return (index for chunk in done for index in chunk if index > after)
