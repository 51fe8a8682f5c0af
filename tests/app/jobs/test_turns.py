"""Whose turn it is: short before long, one caller after the other, bounded, and honest about the wait."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from app.jobs.errors import Busy, ShareUsed
from app.jobs.turns import Length, TurnLimits, Turns

SHORT, LONG = Length.SHORT, Length.LONG


def held(scenario: Callable[[Turns], Coroutine[Any, Any, None]], **limits: int) -> None:
    asyncio.run(asyncio.wait_for(scenario(Turns(TurnLimits(**limits))), 20))


class Work:
    """Solves that begin and end when a test says so; ``order`` is who began, one after the other."""

    def __init__(self, turns: Turns) -> None:
        self.turns, self.order = turns, list[str]()
        self._ends: dict[str, asyncio.Event] = {}
        self.tasks: dict[str, asyncio.Task[None]] = {}

    async def ask(self, name: str, length: Length, patience_s: float | None = 10.0) -> None:
        """``name`` is the caller's letter and a number."""
        self._ends[name] = asyncio.Event()

        async def solve() -> None:
            async with self.turns.turn(length, name[0], patience_s):
                self.order.append(name)
                await self._ends[name].wait()

        self.tasks[name] = asyncio.create_task(solve())
        await asyncio.sleep(0)
        await asyncio.sleep(0)

    async def end(self, name: str) -> None:
        self._ends[name].set()
        await self.tasks[name]
        await asyncio.sleep(0)
        await asyncio.sleep(0)


@pytest.mark.parametrize("workers", [2, 3, 5])
def test_long_work_leaves_a_worker_to_short_work(workers):
    async def scenario(turns: Turns) -> None:
        work = Work(turns)
        for k in range(workers + 3):
            await work.ask(f"a{k}", LONG)
        assert turns.running(LONG) == workers - 1
        await work.ask("b0", SHORT)
        assert work.order[-1] == "b0"
        await work.ask("b1", SHORT)
        assert turns.waiting(SHORT) == 1
        for name in ["b0", "b1"]:
            await work.end(name)
        assert turns.running(SHORT) == 0

    held(scenario, workers=workers)


def test_one_worker_does_both():
    async def scenario(turns: Turns) -> None:
        work = Work(turns)
        for name, length in (("a0", LONG), ("a1", LONG), ("b0", SHORT)):
            await work.ask(name, length)
        await work.end("a0")
        await work.end("b0")
        assert work.order == ["a0", "b0", "a1"]

    held(scenario, workers=1)


def test_short_work_does_not_take_the_workers_that_long_work_waits_for():
    async def scenario(turns: Turns) -> None:
        work = Work(turns)
        for name in ("a0", "a1", "a2", "a3"):
            await work.ask(name, SHORT)
        await work.ask("b0", LONG)
        assert work.order == ["a0", "a1"]
        await work.end("a0")
        assert work.order[-1] == "b0"
        await work.end("a1")
        assert work.order[-1] == "a2"

    held(scenario, workers=2)


@pytest.mark.parametrize("length", Length)
def test_callers_take_turns(length):
    async def scenario(turns: Turns) -> None:
        work = Work(turns)
        names = ["a0", "a1", "a2", "a3", "b0", "b1", "c0"]
        for name in names:
            await work.ask(name, length)
        for k in range(len(names)):
            await work.end(work.order[k])
        assert work.order == ["a0", "a1", "b0", "c0", "a2", "b1", "a3"]

    held(scenario, workers=1)


def test_so_many_may_wait_in_all_and_of_one_caller():
    async def scenario(turns: Turns) -> None:
        work = Work(turns)
        for name in ("a0", "a1", "a2"):  # one works, two wait
            await work.ask(name, LONG)
        with pytest.raises(ShareUsed) as refused:
            await turns.turn(LONG, "a", 1.0).__aenter__()
        assert refused.value.retry_s >= 1
        await work.ask("b0", LONG)
        with pytest.raises(Busy) as refused:
            await turns.turn(LONG, "c", 1.0).__aenter__()
        assert not isinstance(refused.value, ShareUsed)
        # What was promised is not refused, and other lengths wait for themselves.
        await work.ask("c1", LONG, patience_s=None)
        await work.ask("a9", SHORT)
        assert turns.waiting(LONG) == 4 and turns.waiting(SHORT) == 1

    held(scenario, workers=1, waiting=3, waiting_of_one=2)


def test_patience_ends_and_leaves_no_trace():
    async def scenario(turns: Turns) -> None:
        work = Work(turns)
        await work.ask("a0", LONG)
        with pytest.raises(Busy, match=r"within 0\.05 s"):
            await turns.turn(LONG, "b", 0.05).__aenter__()
        assert turns.waiting(LONG) == 0
        await work.end("a0")
        await work.ask("b1", LONG)
        assert work.order == ["a0", "b1"]

    held(scenario, workers=1)


def test_who_gives_up_loses_the_place_to_the_next():
    async def scenario(turns: Turns) -> None:
        work = Work(turns)
        for name in ("a0", "b0", "c0"):
            await work.ask(name, SHORT)
        work.tasks["b0"].cancel()
        await work.end("a0")
        # Given up at the very moment in which the turn came.
        assert work.order == ["a0", "c0"]
        await work.ask("d0", SHORT)
        work._ends["c0"].set()
        await work.tasks["c0"]
        work.tasks["d0"].cancel()
        await asyncio.gather(work.tasks["d0"], return_exceptions=True)
        assert turns.running(SHORT) == 0 and turns.waiting(SHORT) == 0
        await work.ask("e0", SHORT)
        assert work.order[-1] == "e0"

    held(scenario, workers=1)


def test_the_wait_that_is_told_follows_what_solves_take():
    async def scenario(turns: Turns) -> None:
        turns._usual_s[LONG] = 5.0
        assert turns.retry_s(LONG, 4) == 10.0  # two workers are for long work
        assert turns.retry_s(SHORT, 1) == 1.0
        assert turns.retry_s(LONG, 10**6) == 600.0

    held(scenario, workers=3)
