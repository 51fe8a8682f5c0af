"""The fair queue: short before long jobs, turns of callers, limits, and retry estimates."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from app.jobs.errors import Busy, ShareUsed
from app.jobs.fair_queue import FairQueue, JobLength, QueueLimits
from app.jobs.turns import Turns

SHORT, LONG = JobLength.SHORT, JobLength.LONG


def run(scenario: Callable[[FairQueue], Coroutine[Any, Any, None]], **limits: int) -> None:
    asyncio.run(asyncio.wait_for(scenario(FairQueue(QueueLimits(**limits))), 20))


class Work:
    """Jobs that start and end on command; ``order`` lists starts in order."""

    def __init__(self, queue: FairQueue) -> None:
        self.queue, self.order = queue, list[str]()
        self._ends: dict[str, asyncio.Event] = {}
        self.tasks: dict[str, asyncio.Task[None]] = {}

    async def submit(self, name: str, length: JobLength, max_wait_s: float | None = 10.0) -> None:
        """``name`` is the caller's letter and a number."""
        self._ends[name] = asyncio.Event()

        async def solve() -> None:
            async with self.queue.slot(length, name[0], max_wait_s):
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
def test_long_jobs_leave_one_worker_free(workers):
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        for k in range(workers + 3):
            await work.submit(f"a{k}", LONG)
        assert queue.running(LONG) == workers - 1
        await work.submit("b0", SHORT)
        assert work.order[-1] == "b0"
        await work.submit("b1", SHORT)
        assert queue.waiting(SHORT) == 1
        for name in ["b0", "b1"]:
            await work.end(name)
        assert queue.running(SHORT) == 0

    run(scenario, workers=workers)


def test_a_single_worker_serves_both_lengths():
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        for name, length in (("a0", LONG), ("a1", LONG), ("b0", SHORT)):
            await work.submit(name, length)
        await work.end("a0")
        await work.end("b0")
        assert work.order == ["a0", "b0", "a1"]

    run(scenario, workers=1)


def test_short_jobs_yield_to_waiting_long_jobs():
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        for name in ("a0", "a1", "a2", "a3"):
            await work.submit(name, SHORT)
        await work.submit("b0", LONG)
        assert work.order == ["a0", "a1"]
        await work.end("a0")
        assert work.order[-1] == "b0"
        await work.end("a1")
        assert work.order[-1] == "a2"

    run(scenario, workers=2)


@pytest.mark.parametrize("length", JobLength)
def test_the_caller_served_least_recently_is_next(length):
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        names = ["a0", "a1", "a2", "a3", "b0", "b1", "c0"]
        for name in names:
            await work.submit(name, length)
        for k in range(len(names)):
            await work.end(work.order[k])
        assert work.order == ["a0", "b0", "c0", "a1", "b1", "a2", "a3"]

    run(scenario, workers=1)


def test_a_caller_with_one_job_at_a_time_never_waits_for_a_backlog():
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        for k in range(4):
            await work.submit(f"a{k}", SHORT)
        for k in range(3):
            await work.submit(f"b{k}", SHORT)
            await work.end(f"a{k}")
            assert work.order[-1] == f"b{k}"
            await work.end(f"b{k}")

    run(scenario, workers=1)


def test_turns_go_to_the_one_served_least_recently():
    turns: Turns[str] = Turns(memory=2)
    order = []
    for _ in range(6):
        order.append(turns.next("cab"))
        turns.served(order[-1])
    # Of three with a memory for two, one is always new again.
    assert order == ["c", "a", "b", "c", "a", "b"]
    turns.served("x")
    assert turns.next("bx") == "b" and turns.next("ax") == "a"


def test_waiting_is_limited_in_total_and_per_caller():
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        for name in ("a0", "a1", "a2"):  # one runs, two wait
            await work.submit(name, LONG)
        with pytest.raises(ShareUsed) as refused:
            await queue.slot(LONG, "a", 1.0).__aenter__()
        assert refused.value.retry_s >= 1
        await work.submit("b0", LONG)
        with pytest.raises(Busy) as refused:
            await queue.slot(LONG, "c", 1.0).__aenter__()
        assert not isinstance(refused.value, ShareUsed)
        # Accepted runs are never refused, and each length has its own queue.
        await work.submit("c1", LONG, max_wait_s=None)
        await work.submit("a9", SHORT)
        assert queue.waiting(LONG) == 4 and queue.waiting(SHORT) == 1

    run(scenario, workers=1, waiting=3, waiting_per_caller=2)


def test_timing_out_leaves_the_queue_clean():
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        await work.submit("a0", LONG)
        with pytest.raises(Busy, match=r"within 0\.05 s"):
            await queue.slot(LONG, "b", 0.05).__aenter__()
        assert queue.waiting(LONG) == 0
        await work.end("a0")
        await work.submit("b1", LONG)
        assert work.order == ["a0", "b1"]

    run(scenario, workers=1)


def test_cancelling_passes_the_slot_on():
    async def scenario(queue: FairQueue) -> None:
        work = Work(queue)
        for name in ("a0", "b0", "c0"):
            await work.submit(name, SHORT)
        work.tasks["b0"].cancel()
        await work.end("a0")
        # Cancelled in the moment of its admission.
        assert work.order == ["a0", "c0"]
        await work.submit("d0", SHORT)
        work._ends["c0"].set()
        await work.tasks["c0"]
        work.tasks["d0"].cancel()
        await asyncio.gather(work.tasks["d0"], return_exceptions=True)
        assert queue.running(SHORT) == 0 and queue.waiting(SHORT) == 0
        await work.submit("e0", SHORT)
        assert work.order[-1] == "e0"

    run(scenario, workers=1)


def test_retry_after_follows_the_mean_duration():
    async def scenario(queue: FairQueue) -> None:
        queue._mean_s[LONG] = 5.0
        assert queue.retry_s(LONG, 4) == 10.0  # two workers are for long work
        assert queue.retry_s(SHORT, 1) == 1.0
        assert queue.retry_s(LONG, 10**6) == 600.0

    run(scenario, workers=3)
