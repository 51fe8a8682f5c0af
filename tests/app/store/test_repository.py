"""Put, finish, find and list, on both databases."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta, timezone

import pytest

from app.store.errors import IdempotencyConflict, InvalidCursor, UnknownRun
from app.store.record import Finish, RunFilter, RunStatus, new_run_id, utc_now
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.store.records import make_record, make_response


@pytest.fixture
def store(database_url: str) -> Iterator[RunStore]:
    with RunStore(database_url) as store:
        yield store


def test_a_run_round_trips_byte_for_byte(store: RunStore) -> None:
    record = make_record(
        source_run_ids=(new_run_id(), new_run_id()), batch_id=new_run_id(), cached=True, problem=b'{"title":"\xc3\xa4"}'
    )

    async def there_and_back():
        assert await store.put(record) is None
        return await store.get(record.id)

    assert asyncio.run(there_and_back()) == record


def test_times_are_stored_in_utc(store: RunStore) -> None:
    record = make_record(created_at=utc_now().astimezone(timezone(timedelta(hours=5))))

    async def there_and_back():
        await store.put(record)
        return await store.get(record.id)

    back = asyncio.run(there_and_back())
    assert back.created_at == record.created_at and back.created_at.utcoffset() == timedelta(0)


def test_an_unknown_run_raises(store: RunStore) -> None:
    with pytest.raises(UnknownRun):
        asyncio.run(store.get(new_run_id()))


def test_a_failing_row_does_not_affect_others(store: RunStore) -> None:
    twice = make_record()

    async def crowd():
        await store.put(twice)
        records = [make_record(k) for k in range(20)]
        records[7] = twice
        outcomes = await asyncio.gather(*(store.put(each) for each in records), return_exceptions=True)
        for each in records:
            await store.get(each.id)
        return outcomes

    outcomes = asyncio.run(crowd())
    assert isinstance(outcomes[7], Exception)
    assert [each for k, each in enumerate(outcomes) if k != 7] == [None] * 19


def test_a_repeated_request_replays_the_response_byte_for_byte(store: RunStore) -> None:
    first, second = make_record(), make_record()

    async def twice():
        kept = make_response(first)
        assert await store.find_response(kept.key, kept.request_hash) is None
        assert await store.put(first, kept) is None
        assert await store.find_response(kept.key, kept.request_hash) == kept
        assert await store.put(second, make_response(second)) == kept
        with pytest.raises(UnknownRun):
            await store.get(second.id)

    asyncio.run(twice())


def test_the_same_key_with_another_request_is_a_conflict(store: RunStore) -> None:
    first, second = make_record(), make_record()

    async def conflict():
        await store.put(first, make_response(first))
        with pytest.raises(IdempotencyConflict):
            await store.find_response("key-1", "b" * 64)
        with pytest.raises(IdempotencyConflict):
            await store.put(second, make_response(second, request_hash="b" * 64))
        with pytest.raises(UnknownRun):
            await store.get(second.id)

    asyncio.run(conflict())


def test_concurrent_duplicates_have_one_winner(database_url: str) -> None:
    """Two services, one database, twenty requests with one key: one row and one response."""
    records = [make_record(k) for k in range(20)]

    async def race():
        with RunStore(database_url) as one, RunStore(database_url) as other:
            answers = await asyncio.gather(
                *((one, other)[k % 2].put(record, make_response(record)) for k, record in enumerate(records))
            )
            page = await one.list_runs(RunFilter(), limit=100)
        return answers, page

    answers, page = asyncio.run(race())
    winners = [record for record, answer in zip(records, answers, strict=True) if answer is None]
    assert len(winners) == 1
    assert {answer for answer in answers if answer is not None} == {make_response(winners[0])}
    assert [item.id for item in page.items] == [winners[0].id]


def test_an_open_run_ends_once(store: RunStore, database_url: str) -> None:
    record = make_record(status=RunStatus.QUEUED, result=None, effects=b"[]", accuracy=None, timing=b"{}")
    end = Finish(RunStatus.INFEASIBLE, b'{"diagnosis":[]}', None, b"[1]", b'{"requested":1}', b'{"solve_s":1}')

    async def live():
        await store.put(record)
        assert await store.start(record.id)
        running = await store.get(record.id)
        assert await store.finish(record.id, end)
        assert not await store.finish(record.id, Finish(RunStatus.CANCELLED))
        assert not await store.start(record.id)
        return running, await store.get(record.id)

    running, ended = asyncio.run(live())
    assert running == replace(record, status=RunStatus.RUNNING)
    assert ended.status == "infeasible" and ended.result == end.result and ended.spec == record.spec
    assert (ended.effects, ended.accuracy, ended.timing) == (end.effects, end.accuracy, end.timing)
    assert verify(database_url).sound


def test_finishing_an_unknown_run_is_an_error(store: RunStore) -> None:
    with pytest.raises(UnknownRun):
        asyncio.run(store.finish(new_run_id(), Finish(RunStatus.FAILED)))


def test_an_answer_is_found_by_spec_and_solver(store: RunStore) -> None:
    old, new = make_record(), make_record()
    failed = make_record(status=RunStatus.FAILED, result=None)
    assert old.id < new.id < failed.id or sorted({old.id, new.id, failed.id})

    async def find():
        for each in (old, new, failed):
            await store.put(each)
        return (
            await store.find_answer(old.spec_hash, "crankwright", "0.1.0"),
            await store.find_answer(old.spec_hash, "crankwright", "0.2.0"),
            await store.find_answer("0" * 64, "crankwright", "0.1.0"),
        )

    found, other_version, other_spec = asyncio.run(find())
    assert found == max(old, new, key=lambda record: record.id)
    assert other_version is None and other_spec is None


def test_every_filter_restricts(store: RunStore) -> None:
    batch = new_run_id()
    plain = make_record()
    others = {
        "kind": make_record(kind="pin-profile"),
        "mode": make_record(mode="design"),
        "status": make_record(status=RunStatus.FAILED),
        "name": make_record(name="another"),
        "batch_id": make_record(batch_id=batch),
        "holds": make_record(verdict=b'{"holds":false}', holds=False),
    }
    unjudged = make_record(verdict=None, holds=None, created_at=plain.created_at)

    async def look():
        for each in (plain, unjudged, *others.values()):
            await store.put(each)
        found = {}
        for field, record in others.items():
            page = await store.list_runs(RunFilter(**{field: getattr(record, field)}))
            found[field] = [item.id for item in page.items]
        after = await store.list_runs(RunFilter(created_after=others["name"].created_at))
        nothing = await store.list_runs(RunFilter(kind="pin-profile", mode="design"))
        holding = await store.list_runs(RunFilter(holds=True))
        return found, {item.id for item in after.items}, nothing, {item.id for item in holding.items}

    found, after, nothing, holding = asyncio.run(look())
    assert found == {field: [record.id] for field, record in others.items()}
    assert after == {others["batch_id"].id, others["holds"].id}
    assert holding == {plain.id} | {record.id for field, record in others.items() if field != "holds"}
    assert nothing.items == () and nothing.next_cursor is None


@pytest.mark.parametrize("text", ["ШТОК", "шток Ä", "50%", "_"])
def test_text_is_found_in_names_in_either_case(database_url: str, text: str) -> None:
    records = [make_record(name=name) for name in ("Шток Ä İ 50%_", "шток ä i 50%_", "other", None)]

    async def look():
        with RunStore(database_url) as store:
            for each in records:
                await store.put(each)
            return await store.list_runs(RunFilter(text=text))

    found = asyncio.run(look())
    assert {item.id for item in found.items} == {record.id for record in records[:2]}


def test_paging_is_stable_while_runs_are_added(store: RunStore) -> None:
    records = [make_record(k) for k in range(25)]

    async def walk():
        await asyncio.gather(*(store.put(each) for each in records))
        seen: list[str] = []
        cursor = None
        while True:
            page = await store.list_runs(RunFilter(kind="flexible-rod"), cursor, limit=7)
            seen += [item.id for item in page.items]
            cursor = page.next_cursor
            if cursor is None:
                return seen
            await asyncio.sleep(0.002)
            await store.put(make_record())

    assert asyncio.run(walk()) == sorted((record.id for record in records), reverse=True)


@pytest.mark.parametrize("cursor", ["", "x", "!!!!", "MTo", "Mjow" * 20, "ä", "\x00", "MQ=="])
def test_a_foreign_cursor_is_refused(store: RunStore, cursor: str) -> None:
    with pytest.raises(InvalidCursor):
        asyncio.run(store.list_runs(RunFilter(), cursor))


def test_problematic_names_are_stored_or_refused_individually(store: RunStore) -> None:
    """A quote is stored; an unstorable character fails only its own row."""
    odd, bad, fine = make_record(name="'; DROP TABLE runs; --"), make_record(name="a\ud800"), make_record()

    async def crowd():
        outcomes = await asyncio.gather(*(store.put(each) for each in (odd, bad, fine)), return_exceptions=True)
        return outcomes, await store.get(odd.id), await store.get(fine.id)

    outcomes, odd_back, fine_back = asyncio.run(crowd())
    assert outcomes[0] is None and isinstance(outcomes[1], Exception) and outcomes[2] is None
    assert (odd_back, fine_back) == (odd, fine)
