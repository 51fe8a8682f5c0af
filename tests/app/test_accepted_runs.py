"""Runs accepted with 202, with several service processes on one database."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from app import runs
from app.accepted_runs import MAX_ATTEMPTS
from app.designs.kind import Answer, Mode
from app.designs.registry import KINDS, example_of, job_of
from app.designs.rehearsals import FIRST_RUN
from app.encoded_answer import EncodedAnswer
from app.jobs.errors import WorkerCrashed
from app.store.faults import FaultKind, StoreFault
from app.store.record import RunRecord
from app.store.repository import RunStore
from app.store.run_leases import TakeOverExpired
from app.submission import Service, ServiceLimits

PIN = KINDS["pin-profile"]
INFEASIBLE = EncodedAnswer.of(PIN.slug, Mode.DESIGN, Answer("infeasible", {"diagnosis": []}, [], None, {}, None))
LEASE_S = 2.0
"""A multiple of the delays on a loaded machine."""


class Solving:
    """A slow executor that counts its calls and cancellations."""

    ready, warmup_status, background_workers = True, (), 0

    def is_warm(self, *_: str) -> bool:
        return True

    def __init__(self, seconds: float) -> None:
        self.seconds, self.asked, self.ended_early = seconds, 0, 0

    async def run(self, *_: Any, **__: Any) -> EncodedAnswer:
        self.asked += 1
        try:
            await asyncio.sleep(self.seconds)
        except asyncio.CancelledError:
            self.ended_early += 1
            raise
        return INFEASIBLE


def request() -> Any:
    return job_of(PIN, Mode.DESIGN).request.model_validate(example_of(PIN, Mode.DESIGN))


def service(store: RunStore, solving: Any) -> Service:
    return Service(store, solving, 10.0, ServiceLimits(lease_s=LEASE_S))


def with_two_stores(url: str, story: Callable[[RunStore, RunStore], Awaitable[Any]]) -> Any:
    async def two() -> Any:
        with RunStore(url) as one, RunStore(url) as other:
            return await asyncio.wait_for(story(one, other), 60)

    return asyncio.run(two())


async def ended(store: RunStore, run_id: str) -> RunRecord:
    while (run := await store.get(run_id)).status in ("queued", "running"):
        await asyncio.sleep(0.02)
    return run


def test_a_dead_processs_run_is_taken_over_by_one_process(database_url: str) -> None:
    async def story(one: RunStore, other: RunStore) -> None:
        dying = service(one, Solving(1e3))  # never started, so it gives no sign of life
        run_id = (await dying.submit_later(PIN, Mode.DESIGN, request(), None, "")).run_id
        living = [service(store, Solving(0.1)) for store in (one, other)]
        for each in living:
            each.start()
        assert (await ended(one, run_id)).status == "infeasible"
        assert sum(each.executor.asked for each in living) == 1
        for each in (dying, *living):
            await each.close()

    with_two_stores(database_url, story)


def test_a_live_process_keeps_runs_longer_than_a_lease(database_url: str) -> None:
    async def story(one: RunStore, other: RunStore) -> None:
        busy, idle = service(one, Solving(2 * LEASE_S)), service(other, Solving(0.0))
        busy.start(), idle.start()
        run_id = (await busy.submit_later(PIN, Mode.DESIGN, request(), None, "")).run_id
        assert (await ended(one, run_id)).status == "infeasible"
        assert (busy.executor.asked, idle.executor.asked) == (1, 0)
        await busy.close(), await idle.close()

    with_two_stores(database_url, story)


def test_a_run_cancelled_by_another_process_is_no_longer_solved(database_url: str) -> None:
    async def story(one: RunStore, other: RunStore) -> None:
        busy, idle = service(one, Solving(1e3)), service(other, Solving(0.0))
        busy.start()
        run_id = (await busy.submit_later(PIN, Mode.DESIGN, request(), None, "")).run_id
        while not busy.executor.asked:
            await asyncio.sleep(0.01)
        await idle.cancel(run_id)
        while not busy.executor.ended_early:
            await asyncio.sleep(0.02)
        assert (await one.get(run_id)).status == "cancelled"
        await busy.close()

    with_two_stores(database_url, story)


def test_a_run_fails_after_too_many_process_deaths(database_url: str) -> None:
    run = runs.queued(PIN.slug, Mode.DESIGN, request())

    async def story(one: RunStore, _other: RunStore) -> None:
        await one.put_leased(run, None, "dead", -1.0)
        for _ in range(MAX_ATTEMPTS):
            (taken,) = await one.write(TakeOverExpired("dead", -1.0, 1))
            await one.start(taken.run.id)
        living = service(one, Solving(0.0))
        living.start()
        failed = await ended(one, run.id)
        assert failed.status == "failed" and f"{MAX_ATTEMPTS} times".encode() in failed.problem
        assert living.executor.asked == 0
        await living.close()

    with_two_stores(database_url, story)


def test_a_result_that_cannot_be_stored_is_kept_until_it_can(database_url: str, monkeypatch) -> None:
    async def story(one: RunStore, _other: RunStore) -> None:
        living, tries, finish = service(one, Solving(0.0)), [], one.finish

        async def full_at_first(*given: Any) -> Any:
            tries.append(given)
            if len(tries) < 3:
                raise StoreFault(FaultKind.FULL, "no space left")
            return await finish(*given)

        monkeypatch.setattr(one, "finish", full_at_first)
        run_id = (await living.submit_later(PIN, Mode.DESIGN, request(), None, "")).run_id
        assert (await ended(one, run_id)).status == "infeasible"
        assert len(tries) == 3 and living.executor.asked == 1
        await living.close()

    with_two_stores(database_url, story)


def test_a_crashed_worker_is_retried_five_times(database_url: str) -> None:
    class Crashing(Solving):
        async def run(self, *_: Any, **__: Any) -> EncodedAnswer:
            self.asked += 1
            if self.asked <= self.seconds:
                raise WorkerCrashed(9)
            return INFEASIBLE

    async def story(one: RunStore, _other: RunStore) -> None:
        for crashes, status in ((5, "infeasible"), (6, "failed")):
            living = service(one, Crashing(crashes))
            run_id = (await living.submit_later(PIN, Mode.DESIGN, request(), None, "")).run_id
            assert (await ended(one, run_id)).status == status
            assert living.executor.asked == 6
            await living.close()

    with_two_stores(database_url, story)


def test_the_first_run_waits_for_its_own_kernels(database_url: str) -> None:
    """Whatever its name; another design of a rod waits for the kernels of all."""

    class Cold(Solving):
        def is_warm(self, *part: str) -> bool:
            return part == FIRST_RUN

    rod = KINDS["flexible-rod"]
    first = job_of(rod, Mode.DESIGN).request.model_validate({**example_of(rod, Mode.DESIGN), "name": "mine"})

    async def story(one: RunStore, _other: RunStore) -> None:
        living = service(one, Cold(0.0))
        later = await living.submit_later(rod, Mode.DESIGN, first.model_copy(update={"accuracy": 1e-3}), None, "")
        run_id = (await living.submit_later(rod, Mode.DESIGN, first, None, "")).run_id
        assert (await ended(one, run_id)).status == "infeasible"
        assert (await one.get(later.run_id)).status == "queued"
        await living.close()

    with_two_stores(database_url, story)
