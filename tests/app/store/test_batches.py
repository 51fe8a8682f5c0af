"""Batches in the store: leases, exactly one row per item, counters, integrity check."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from sqlalchemy import delete, update

from app.store.batch_inputs import Row, Source, packed_rows
from app.store.batch_items import encoded, packed, sealed
from app.store.batch_operations import (
    Acknowledge,
    Cancel,
    Claim,
    Drop,
    DropAbandoned,
    Finish,
    Open,
    Receive,
    Release,
    Renew,
    Split,
)
from app.store.batch_reads import get_batch, items_after, open_items
from app.store.batch_records import DAMAGED, BatchRecord, Block, Chunk, Item, item_id, new_batch_id, split_item_id
from app.store.engine import WRITE
from app.store.errors import DamagedRecord, IdempotencyConflict, UnknownBatch, UnknownRun
from app.store.hashing import canonical_json
from app.store.models import batch_items, batches
from app.store.record import RunFilter, RunOrder, utc_now
from app.store.repository import RunStore
from app.store.verify import verify

SPEC = {"name": "pin", "load": {"force_n": 1.0}}


def record(**changes: Any) -> BatchRecord:
    values: dict[str, Any] = {
        "number": 0, "id": new_batch_id(), "kind": "pin-profile", "mode": "check", "name": "night", "detail": "scalars",
        "status": "receiving", "source": Source("ndjson").to_json(), "dictionary": b'{"spec":{"load"', "total": 0,
        "solver_name": "crankwright", "solver_version": "1", "succeeded": 0, "infeasible": 0, "failed": 0,
        "refused": 0, "created_at": utc_now(), "started_at": None, "ended_at": None,
    }  # fmt: skip
    return BatchRecord(**{**values, **changes})


async def received(store: RunStore, count: int = 10, key: str | None = None, blocks: int = 2) -> BatchRecord:
    """Store an acknowledged batch of rows in blocks of equal size."""
    new = record()
    number = await store.write(Open(new))
    size = count // blocks
    for first in range(0, count, size):
        rows = [Row(first + k + 1, b'{"name":"row %d"}' % (first + k)) for k in range(size)]
        assert await store.write(Receive(number, (Block(first, size, packed_rows(rows)),)))
    assert await store.write(Acknowledge(number, count, key, "h" * 64, b"{}")) is None
    return await store.query(lambda connection: get_batch(connection, new.id))


def items(batch: BatchRecord, chunk: Chunk, status: str = "succeeded") -> bytes:
    def content(index: int) -> bytes:
        parts = {"result": {"x": index}, "figure_name": "x"}
        return packed(encoded(canonical_json(SPEC), parts), batch.dictionary)

    found = (Item(k, k + 1, status, k % 2 == 0, float(k), content(k)) for k in range(chunk.first, chunk.end))
    return sealed(batch.number, found)


def run(url: str, story: Callable[[RunStore], Awaitable[None]]) -> None:
    with RunStore(url) as store:
        asyncio.run(story(store))  # type: ignore[arg-type]


def test_every_item_is_stored_exactly_once(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        batch = await received(store)
        first = await store.write(Claim(batch.number, "a", 30.0, 2, 3))
        assert [(c.first, c.count, c.block, c.attempts) for c in first] == [(0, 3, 0, 1), (5, 3, 5, 1)]
        # Leased chunks are exclusive.
        second = await store.write(Claim(batch.number, "b", 30.0, 9, 100))
        assert [(c.first, c.count) for c in second] == [(3, 2), (8, 2)]
        assert await store.write(Claim(batch.number, "c", 30.0, 9, 100)) == []
        assert await store.write(Finish(first[0], "a", items(batch, first[0])))
        # Repeated, or by a process without the lease: no effect.
        assert not await store.write(Finish(first[0], "a", items(batch, first[0], "failed")))
        assert not await store.write(Finish(first[1], "b", items(batch, first[1])))
        for chunk, owner in ((first[1], "a"), (second[0], "b"), (second[1], "b")):
            assert await store.write(Finish(chunk, owner, items(batch, chunk)))
        ended = await store.query(lambda connection: get_batch(connection, batch.id))
        assert (ended.status, ended.succeeded, ended.done) == ("ended", 10, 10)
        stored = await store.query(lambda connection: items_after(connection, batch.number, -1, 100))
        assert [(item.index, item.line) for item in stored] == [(k, k + 1) for k in range(10)]

    run(database_url, story)
    report = verify(database_url)
    assert (report.damages, report.batch_items) == ((), 10)


def test_chunks_become_smaller_towards_the_end(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        batch = await received(store, 96)
        counts = []
        while claimed := await store.write(Claim(batch.number, "a", 30.0, 1, 16, 0.25)):
            counts += [chunk.count for chunk in claimed]
        # A quarter of the waiting items, at most 16 and at least 16/8; the last chunk of a block is its remainder.
        assert counts == [16, 16, 16, 12, 9, 7, 5, 4, 3, 2, 2, 2, 2]

    run(database_url, story)


def test_expired_leases_are_taken_over_and_late_answers_are_dropped(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        batch = await received(store)
        [old] = await store.write(Claim(batch.number, "dead", -1.0, 1, 5))
        [new, *_] = await store.write(Claim(batch.number, "alive", 30.0, 1, 100))
        assert (new.first, new.count, new.attempts) == (0, 5, 2)
        assert not await store.write(Finish(old, "dead", items(batch, old)))
        await store.write(Renew("alive", -1.0))
        assert [c.first for c in await store.write(Claim(batch.number, "next", 30.0, 1, 100))] == [0]
        await store.write(Release("next"))
        again = await store.write(Claim(batch.number, "last", 30.0, 2, 100))
        assert [(c.first, c.attempts) for c in again] == [(0, 3), (5, 1)]
        # A lease that ends later than any can is from before the clock was set back.
        await store.write(Renew("last", 86_400.0))
        assert [c.first for c in await store.write(Claim(batch.number, "later", 30.0, 2, 100))] == [0, 5]

    run(database_url, story)
    assert verify(database_url).sound


def test_a_chunk_is_split_down_to_one_item(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        batch = await received(store, blocks=1)
        [chunk] = await store.write(Claim(batch.number, "a", 30.0, 1, 5))
        assert await store.write(Split(chunk, "a"))
        found = await store.write(Claim(batch.number, "a", 30.0, 9, 100))
        assert [(c.first, c.count, c.attempts) for c in found] == [(0, 2, 1), (2, 3, 1), (5, 5, 1)]
        assert await store.write(Split(found[0], "a"))
        [one, *_] = await store.write(Claim(batch.number, "a", 30.0, 9, 100))
        assert one.count == 1
        assert not await store.write(Split(one, "a"))

    run(database_url, story)
    assert verify(database_url).sound


def test_cancelled_batches_accept_no_answers(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        batch = await received(store)
        done, lost = await store.write(Claim(batch.number, "a", 30.0, 2, 3))
        await store.write(Finish(done, "a", items(batch, done)))
        assert await store.write(Cancel(batch.number))
        assert not await store.write(Cancel(batch.number))
        assert not await store.write(Finish(lost, "a", items(batch, lost)))
        assert await store.write(Claim(batch.number, "a", 30.0, 9, 9)) == []
        ended = await store.query(lambda connection: get_batch(connection, batch.id))
        assert (ended.status, ended.done, ended.cancelled) == ("cancelled", 3, 7)
        assert (await store.get(item_id(batch.id, 9))).status == "cancelled"

    run(database_url, story)
    assert verify(database_url).sound


def test_unacknowledged_batches_are_hidden(database_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    async def story(store: RunStore) -> None:
        kept, left = record(), record()
        number = await store.write(Open(kept))
        await store.write(Receive(number, (Block(0, 1, packed_rows([Row(1, b"{}")])),)))
        with pytest.raises(UnknownBatch):
            await store.query(lambda connection: get_batch(connection, kept.id))
        with pytest.raises(UnknownRun):
            await store.get(item_id(kept.id, 0))
        assert await store.write(DropAbandoned()) == 0
        await store.write(Drop(number))
        monkeypatch.setattr("app.store.batch_operations.RECEIVING_S", -1.0)
        number = await store.write(Open(left))
        assert await store.write(DropAbandoned()) == 1
        assert not await store.write(Receive(number, (Block(0, 1, packed_rows([Row(1, b"{}")])),)))

    run(database_url, story)


def test_idempotency_keys_repeat_the_first_answer(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        await received(store, key="k")
        number = await store.write(Open(record()))
        assert await store.write(Acknowledge(number, 0, "k", "h" * 64, b"other")) == b"{}"
        number = await store.write(Open(record()))
        with pytest.raises(IdempotencyConflict):
            await store.write(Acknowledge(number, 0, "k", "x" * 64, b"other"))

    run(database_url, story)


def test_items_of_any_state_are_listed_as_runs(database_url: str) -> None:
    async def listed(store: RunStore, order: RunOrder = RunOrder.NEWEST, **wanted: Any) -> list[tuple[int, str]]:
        found, cursor = [], None
        while True:
            page = await store.list_runs(RunFilter(**wanted), cursor, 2, order)
            found += [(split_item_id(run.id)[1], run.status) for run in page.items]  # type: ignore[index]
            cursor = page.next_cursor
            if cursor is None:
                return found

    async def story(store: RunStore) -> None:
        batch = await received(store)
        good, bad, open_ = await store.write(Claim(batch.number, "a", 30.0, 1, 3)), None, None
        await store.write(Finish(good[0], "a", items(batch, good[0])))
        [bad] = await store.write(Claim(batch.number, "a", 30.0, 1, 2))
        await store.write(Finish(bad, "a", items(batch, bad, "refused")))
        [open_] = await store.write(Claim(batch.number, "a", 30.0, 1, 2))
        assert open_.first == 5
        states = ["succeeded"] * 3 + ["failed"] * 2 + ["running"] * 2 + ["queued"] * 3
        everything = list(enumerate(states))
        assert await listed(store, batch_id=batch.id) == everything[::-1]
        assert await listed(store, RunOrder.OLDEST, batch_id=batch.id) == everything
        for status in ("succeeded", "failed", "running", "queued", "cancelled"):
            of_status = [each for each in everything if each[1] == status]
            assert await listed(store, RunOrder.OLDEST, batch_id=batch.id, status=status) == of_status
            assert await listed(store, batch_id=batch.id, status=status) == of_status[::-1]
        assert await listed(store, batch_id=batch.id, holds=True) == [(4, "failed"), (2, "succeeded"), (0, "succeeded")]
        by_figure = await listed(store, RunOrder.GREATEST, batch_id=batch.id)
        assert [k for k, _ in by_figure] == [4, 3, 2, 1, 0]
        assert await listed(store, batch_id=batch.id, kind="flexible-rod") == []
        assert await listed(store, batch_id=batch.id, text="ROW 7") == [(7, "queued")]
        done = await store.get(item_id(batch.id, 2))
        assert (done.result, done.batch_id, done.figure_name) == (b'{"x":2}', batch.id, "x")
        assert (await store.get(item_id(batch.id, 8))).spec == b'{"name":"row 8"}'
        with pytest.raises(UnknownRun):
            await store.get(item_id(batch.id, 10))

    run(database_url, story)


async def walked(store: RunStore, order: RunOrder, limit: int, **wanted: Any) -> list[int]:
    """The indices of the items on all pages."""
    found, cursor = [], None
    while True:
        page = await store.list_runs(RunFilter(**wanted), cursor, limit, order)
        found += [split_item_id(run.id)[1] for run in page.items]  # type: ignore[index]
        cursor = page.next_cursor
        if cursor is None:
            return found


@pytest.mark.parametrize("longest_s", [0.0, 60.0])
def test_a_search_for_names_finds_every_item(
    database_url: str, monkeypatch: pytest.MonkeyPatch, longest_s: float
) -> None:
    """Also if pages end early, and where the database is asked for a few rows at a time."""
    monkeypatch.setattr("app.store.item_runs._LONGEST_SEARCH_S", longest_s)
    monkeypatch.setattr("app.store.item_runs._ROWS", 3)
    monkeypatch.setattr("app.store.item_runs._PLACES", 7)
    needles = [0, 4, 15, 16, 29]

    def item(batch: BatchRecord, k: int) -> Item:
        spec = canonical_json({**SPEC, "name": "Needle" if k in needles else f"row {k}"})
        content = packed(encoded(spec, {}), batch.dictionary)
        return Item(k, k + 1, "succeeded" if k % 2 else "infeasible", True, float(k // 4), content)

    async def story(store: RunStore) -> None:
        batch = await received(store, 30)
        for chunk in await store.write(Claim(batch.number, "a", 30.0, 30, 100)):
            answers = sealed(batch.number, (item(batch, k) for k in range(chunk.first, chunk.end)))
            await store.write(Finish(chunk, "a", answers))
        for order in (RunOrder.OLDEST, RunOrder.LEAST, RunOrder.NEWEST, RunOrder.GREATEST):
            expected = needles if order in (RunOrder.OLDEST, RunOrder.LEAST) else needles[::-1]
            odd = [k for k in expected if k % 2]
            for limit in (1, 2, 50):
                for wanted in ({"name": "Needle"}, {"text": "eEDL"}, {"name": "Needle", "holds": True}):
                    assert await walked(store, order, limit, batch_id=batch.id, **wanted) == expected
                assert await walked(store, order, limit, batch_id=batch.id, name="Needle", status="succeeded") == odd
                everything = await walked(store, order, limit, batch_id=batch.id)
                assert sorted(everything) == list(range(30))

    run(database_url, story)


@pytest.mark.parametrize("name", ["Шток Ä İ", "шток ä i"])
def test_text_is_found_in_a_name_in_either_case(database_url: str, name: str) -> None:
    async def story(store: RunStore) -> None:
        batch = await received(store, 1, blocks=1)
        [chunk] = await store.write(Claim(batch.number, "a", 30.0, 1, 1))
        content = packed(encoded(canonical_json({"name": name}), {}), batch.dictionary)
        await store.write(Finish(chunk, "a", sealed(batch.number, [Item(0, 1, "succeeded", None, None, content)])))
        for text in ("ШТОК Ä", "шток", "Шток ä"):
            assert await walked(store, RunOrder.NEWEST, 1, batch_id=batch.id, text=text) == [0]
        assert await walked(store, RunOrder.NEWEST, 1, batch_id=batch.id, text="шток a") == []

    run(database_url, story)


def test_a_verdict_is_no_filter_of_open_items(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        batch = await received(store)
        assert await walked(store, RunOrder.NEWEST, 50, batch_id=batch.id, status="queued", holds=True) == []
        assert len(await walked(store, RunOrder.NEWEST, 50, batch_id=batch.id, status="queued")) == 10

    run(database_url, story)


async def finished(store: RunStore) -> BatchRecord:
    """A batch of ten items that has ended."""
    batch = await received(store)
    for chunk in await store.write(Claim(batch.number, "a", 30.0, 2, 100)):
        await store.write(Finish(chunk, "a", items(batch, chunk)))
    return batch


def damage(store: RunStore, batch: BatchRecord, index: int) -> None:
    """Change an item behind the store's back."""
    here = batch_items.c.batch == batch.number, batch_items.c.index == index
    with store._engine.connect().execution_options(**WRITE) as connection, connection.begin():
        connection.execute(update(batch_items).where(*here).values(content=b"wrong", holds=index % 2 != 0))


def test_a_damaged_item_is_named_and_the_others_are_shown(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        assert await store.query(open_items) == 0
        await received(store)
        assert await store.query(open_items) == 10
        batch = await finished(store)
        assert await store.query(open_items) == 10
        damage(store, batch, 4)
        bad = item_id(batch.id, 4)
        stored = await store.query(lambda connection: items_after(connection, batch.number, -1, 100))
        assert [item.index for item in stored if item.status != DAMAGED] == [0, 1, 2, 3, 5, 6, 7, 8, 9]
        assert stored[4] == Item(4, None, DAMAGED, None, 4.0, b"")
        with pytest.raises(DamagedRecord):
            await store.get(bad)
        for order in (RunOrder.NEWEST, RunOrder.OLDEST, RunOrder.LEAST, RunOrder.GREATEST):
            for size in (1, 2, 3, 50):
                shown, named, cursor = [], [], None
                while True:
                    page = await store.list_runs(RunFilter(batch_id=batch.id), cursor, size, order)
                    shown += [run.id for run in page.items]
                    named += page.damaged
                    if (cursor := page.next_cursor) is None:
                        break
                assert sorted([*shown, bad]) == [item_id(batch.id, k) for k in range(10)] and named == [bad]
        searched = await store.list_runs(RunFilter(batch_id=batch.id, text="pin"))
        assert len(searched.items) == 9 and searched.damaged == (bad,)

    run(database_url, story)


def test_verify_detects_loss_and_corruption(database_url: str) -> None:
    async def story(store: RunStore) -> None:
        for _ in range(3):
            await finished(store)
        with store._engine.connect().execution_options(**WRITE) as connection, connection.begin():
            connection.execute(
                update(batch_items).where(batch_items.c.batch == 1, batch_items.c.index == 4).values(figure=0.5)
            )
            connection.execute(delete(batch_items).where(batch_items.c.batch == 2, batch_items.c.index == 9))
            connection.execute(update(batches).where(batches.c.number == 3).values(succeeded=9, failed=1))

    run(database_url, story)
    found = sorted((damage.table, damage.what) for damage in verify(database_url).damages)
    assert [table for table, _ in found] == ["batch_items", "batch_items", "batches", "batches"]
    assert [what for _, what in found][:2] == [
        "1 items of chunks that are done are missing",
        "the content does not agree with its hash",
    ]
