"""Leases on accepted runs: exclusive, taken over after expiry, and ended once."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from sqlalchemy import select, update

from app.store.engine import make_engine
from app.store.leases import LONGEST_LEASE_S
from app.store.models import promises, runs
from app.store.record import Finish, RunStatus
from app.store.repository import RunStore
from app.store.run_leases import ReleaseLeases, RenewLeases, TakeOverExpired
from app.store.verify import verify
from tests.app.store.records import make_record, make_response


def with_store(url: str, story: Callable[[RunStore], Awaitable[Any]]) -> Any:
    async def told() -> Any:
        with RunStore(url) as store:
            return await story(store)

    return asyncio.run(told())


def queued():
    return make_record(status=RunStatus.QUEUED, result=None)


def test_an_expired_lease_is_taken_over_exactly_once(database_url: str) -> None:
    first, second, held = queued(), queued(), queued()

    async def story(store: RunStore) -> None:
        await store.put_leased(first, None, "dead", -1.0)
        await store.put_leased(second, make_response(second), "dead", -1.0)
        await store.put_leased(held, None, "alive", 60.0)
        await store.start(second.id)
        one, other = await asyncio.gather(*(store.write(TakeOverExpired(who, 60.0, 1)) for who in ("one", "other")))
        assert {taken.run.id: taken.attempts for taken in one + other} == {first.id: 0, second.id: 1}
        assert await store.write(TakeOverExpired("third", 60.0, 9)) == []
        owner = "one" if one[0].run.id == first.id else "other"
        assert await store.write(RenewLeases(owner, 60.0)) == {first.id}
        # The end of a run deletes its lease; a later end has no effect.
        assert await store.finish(first.id, Finish(RunStatus.CANCELLED))
        assert await store.write(RenewLeases(owner, 60.0)) == set()
        assert not await store.finish(first.id, Finish(RunStatus.FAILED))

    with_store(database_url, story)
    assert verify(database_url).sound


def test_a_lease_from_before_the_clock_was_set_back_is_taken_over(database_url: str) -> None:
    left, held = queued(), queued()

    async def story(store: RunStore) -> None:
        await store.put_leased(left, None, "dead", 86_400.0)
        await store.put_leased(held, None, "alive", LONGEST_LEASE_S - 1.0)
        assert [taken.run.id for taken in await store.write(TakeOverExpired("one", 60.0, 9))] == [left.id]

    with_store(database_url, story)


def test_an_orderly_shutdown_releases_leases_without_counting_attempts(database_url: str) -> None:
    run = queued()

    async def story(store: RunStore) -> None:
        await store.put_leased(run, None, "one", 60.0)
        await store.start(run.id)
        await store.write(ReleaseLeases("one"))
        (taken,) = await store.write(TakeOverExpired("two", 60.0, 9))
        assert (taken.run.id, taken.attempts) == (run.id, 0)

    with_store(database_url, story)


def test_a_replayed_request_creates_no_lease(database_url: str) -> None:
    first, second = queued(), queued()

    async def story(store: RunStore) -> None:
        assert await store.put_leased(first, make_response(first), "one", 60.0) is None
        assert (await store.put_leased(second, make_response(second), "one", 60.0)).run_id == first.id
        assert await store.write(RenewLeases("one", 60.0)) == {first.id}

    with_store(database_url, story)


def test_a_damaged_run_loses_its_lease(database_url: str) -> None:
    run = queued()

    async def story(store: RunStore) -> None:
        await store.put_leased(run, None, "dead", -1.0)
        engine = make_engine(database_url)
        with engine.begin() as connection:
            connection.execute(update(runs).values(spec=b'{"x":2}'))
        assert await store.write(TakeOverExpired("one", 60.0, 9)) == []
        with engine.connect() as connection:
            assert connection.execute(select(promises)).all() == []
        engine.dispose()

    with_store(database_url, story)
