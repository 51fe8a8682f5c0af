"""An idempotency key stands for one answer, whether of a run or of a batch."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from datetime import timedelta

import pytest
from sqlalchemy import Connection

from app.store.batch_operations import Acknowledge, Open, find_answer
from app.store.engine import WRITE, make_engine
from app.store.errors import IdempotencyConflict, UnknownRun
from app.store.operations import PutOnce
from app.store.record import utc_now
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.store.records import make_record, make_response
from tests.app.store.test_batches import received, record

KEY = "key-1"


async def refused(write: Awaitable[object]) -> None:
    with pytest.raises(IdempotencyConflict):
        await write


def test_a_batchs_key_is_refused_to_a_run(database_url: str) -> None:
    run = make_record()

    async def story(store: RunStore) -> None:
        await received(store, key=KEY)
        await refused(store.find_response(KEY, "a" * 64))
        await refused(store.put(run, make_response(run, KEY)))
        with pytest.raises(UnknownRun):
            await store.get(run.id)

    with RunStore(database_url) as store:
        asyncio.run(story(store))
    assert verify(database_url).sound


def test_an_expired_key_of_a_run_serves_a_batch(database_url: str) -> None:
    """Whether or not its row has been deleted yet."""
    run = make_record()

    async def story(store: RunStore) -> None:
        await store.put(run, make_response(run, KEY))
        now = utc_now() + timedelta(seconds=1)
        number = await store.write(Open(record()))
        await refused(store.write(Acknowledge(number, 0, KEY, "h" * 64, b"{}", now - timedelta(days=1))))
        assert await store.query(lambda connection: find_answer(connection, KEY, "h" * 64, now)) is None
        assert await store.write(Acknowledge(number, 0, KEY, "h" * 64, b"{}", now)) is None
        assert await store.query(lambda connection: find_answer(connection, KEY, "h" * 64)) == b"{}"
        await refused(store.find_response(KEY, "a" * 64))

    with RunStore(database_url) as store:
        asyncio.run(story(store))
    assert verify(database_url).sound


@pytest.mark.parametrize("batch_first", [True, False], ids=["batch first", "run first"])
def test_a_run_and_a_batch_under_one_key_have_one_winner(database_url: str, batch_first: bool) -> None:
    """Another process has written the first of the two, and commits it only while the second one is being written."""
    run = make_record()

    async def story(store: RunStore, elsewhere: Connection) -> None:
        acknowledge = Acknowledge(await store.write(Open(record())), 0, KEY, "h" * 64, b"{}")
        put = PutOnce(run, make_response(run, KEY))
        first, second = (acknowledge, put) if batch_first else (put, acknowledge)
        with elsewhere.begin():
            assert first(elsewhere) is None
            late = asyncio.create_task(store.write(second))
            await asyncio.sleep(0.3)
            assert not late.done()
        await refused(late)

    engine = make_engine(database_url)
    with RunStore(database_url) as store, engine.connect().execution_options(**WRITE) as elsewhere:
        asyncio.run(story(store, elsewhere))
    engine.dispose()
    assert verify(database_url).sound
