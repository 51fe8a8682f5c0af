"""Deduplication of concurrent requests with the same key."""

from __future__ import annotations

import asyncio

import pytest

from app.single_flight import SingleFlight
from app.store.errors import IdempotencyConflict


class Solve:
    """A solve that counts starts and cancellations."""

    def __init__(self, seconds: float = 0.05) -> None:
        self.seconds = seconds
        self.begun = self.given_up = 0

    async def __call__(self) -> object:
        self.begun += 1
        try:
            await asyncio.sleep(self.seconds)
        except asyncio.CancelledError:
            self.given_up += 1
            raise
        return object()


def test_fifty_concurrent_callers_share_one_result():
    async def scenario() -> None:
        single_flight, solve = SingleFlight(), Solve()
        answers = await asyncio.gather(*(single_flight.run("key", "body", solve) for _ in range(50)))
        assert solve.begun == 1 and len(set(map(id, answers))) == 1
        await single_flight.run("key", "body", solve)
        assert solve.begun == 2, "what has ended is not under way"

    asyncio.run(scenario())


def test_another_body_under_the_same_key_is_a_conflict():
    async def scenario() -> None:
        single_flight, solve = SingleFlight(), Solve()
        first = asyncio.create_task(single_flight.run("key", "body", solve))
        await asyncio.sleep(0)
        with pytest.raises(IdempotencyConflict):
            await single_flight.run("key", "other", solve)
        await asyncio.gather(first, single_flight.run("other key", "other", solve))
        assert solve.begun == 2

    asyncio.run(scenario())


def test_the_call_continues_while_anyone_waits():
    async def scenario() -> None:
        single_flight, solve = SingleFlight(), Solve()
        tasks = [asyncio.create_task(single_flight.run("key", "body", solve)) for _ in range(3)]
        await asyncio.sleep(0.01)
        tasks[0].cancel()
        tasks[1].cancel()
        assert await tasks[2] is not None and solve.given_up == 0
        endless = Solve(3600.0)
        alone = asyncio.create_task(single_flight.run("key", "body", endless))
        await asyncio.sleep(0.01)
        alone.cancel()
        await asyncio.sleep(0)
        assert await single_flight.run("key", "body", solve) is not None, "whoever comes then begins anew"
        assert (endless.begun, endless.given_up, solve.begun) == (1, 1, 2)

    asyncio.run(scenario())


def test_a_failure_reaches_all_callers():
    async def fail() -> None:
        await asyncio.sleep(0.01)
        raise ZeroDivisionError

    async def scenario() -> None:
        single_flight = SingleFlight()
        found = await asyncio.gather(
            *(single_flight.run("key", "body", fail) for _ in range(3)), return_exceptions=True
        )
        assert [type(error) for error in found] == [ZeroDivisionError] * 3

    asyncio.run(scenario())
