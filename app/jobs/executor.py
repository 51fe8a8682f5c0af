"""Solves outside the service process, behind one interface."""

from __future__ import annotations

import asyncio
import contextlib
import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Protocol

from app.designs.kind import Answer
from app.designs.progress import Report, to_nobody
from app.jobs import calls
from app.jobs.errors import Busy, ExecutorClosed, JobError, WorkerCrashed
from app.jobs.pool import Call, Place
from app.jobs.template import Template
from app.jobs.warming import KernelWarming, Told, Warmth, tell_nobody
from app.jobs.worker import Entry, Load, WorkerSettings
from app.logging import get_logger

logger = get_logger(__name__)

DEFAULT_BUDGET_S = 10.0
DEFAULT_QUEUE_LIMIT = 64

_LOOK_S = 0.2
"""How often the pool looks whether its processes live."""
_BETWEEN_STARTS_S = 1.0


class Executor(Protocol):
    """Runs jobs of the registry somewhere that cannot hurt the service."""

    @property
    def ready(self) -> bool:
        """Whether it can answer now."""

    @property
    def warmths(self) -> list[Warmth]:
        """How far the kernels of every kind are; empty where nothing has to be compiled."""

    def start(self) -> None:
        """Begin to warm up; returns at once."""

    async def run(
        self,
        kind_slug: str,
        mode: str,
        payload: bytes,
        budget_s: float = DEFAULT_BUDGET_S,
        report: Report = to_nobody,
    ) -> Answer:
        """The answer to a request given as JSON; ``report`` hears, from another thread, how far a long one is.

        Raises Busy when too many wait already, BudgetExceeded when the solve takes longer than ``budget_s``
        seconds of wall-clock time (counted from its start, not from its place in the queue), MemoryExceeded,
        WorkerCrashed, SolveFailed. Cancelling the awaiting task ends the solve.
        """

    async def run_in_background(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        """The same for a piece of a batch, on workers that leave the processor to all others; waits for its turn."""

    @property
    def background_workers(self) -> int:
        """How many pieces of batches can be worked on at once."""

    def close(self) -> None:
        """End every solve and every worker."""


@dataclass(frozen=True)
class PoolSettings:
    """Size and limits of a process pool.

    ``entry`` and ``load`` are module-level functions; ``preload`` is the module that the workers' template imports, its
    function ``load_step_by_step`` what they do meanwhile. ``kernels`` is whether calls wait for compiled kernels.
    """

    workers: int = os.cpu_count() or 1
    queue_limit: int = DEFAULT_QUEUE_LIMIT
    memory_bytes: int = 2 << 30
    niceness: int = 10
    entry: Entry = calls.answer
    load: Load = calls.load
    preload: str = "app.jobs.preload"
    idle_work: Callable[[], Iterator[None]] = calls.load_step_by_step
    kernels: bool = True
    told: Told = tell_nobody
    background_workers: int = 0
    background_entry: Entry = calls.answer
    background_niceness: int = 19


class Lane:
    """Workers of one purpose, and the calls that wait for them. No lane waits for another."""

    def __init__(self, worker: WorkerSettings, template: Template, workers: int, name: str) -> None:
        self.workers = workers
        self.places = [Place(worker, template) for _ in range(workers)]
        # One thread per worker, waiting on its pipe: as many places as threads, so there is always a free one.
        self.threads = ThreadPoolExecutor(max(1, workers), thread_name_prefix=name)
        self.pending, self._preparing = 0, 0
        self._free = list(self.places)
        self._lock = threading.Lock()

    def take(self) -> Place:
        """A free place, one with a worker if there is such a one."""
        with self._lock:
            for place in self._free:
                if place.ready:
                    self._free.remove(place)
                    return place
            return self._free.pop()

    def give_back(self, place: Place) -> None:
        with self._lock:
            self._free.append(place)

    def count_lost(self) -> int:
        """How many free places have no live worker and nobody on the way to give them one."""
        with self._lock:
            lost = sum(not place.ready for place in self._free) - self._preparing
            self._preparing += max(0, lost)
        return lost

    def take_lost(self) -> Place | None:
        """A free place that has no live worker."""
        with self._lock:
            place = next((place for place in self._free if not place.ready), None)
            if place is not None:
                self._free.remove(place)
        return place

    def prepared(self, place: Place | None) -> None:
        """Somebody tried to give the place a worker."""
        with self._lock:
            self._preparing -= 1
            if place is not None:
                self._free.append(place)


class ProcessPool:
    """Warm worker processes on this machine, forked from a template that has the solvers imported.

    A worker that overruns its budget, dies, or runs out of memory is killed and replaced, and so is the template; the
    other solves go on. At most ``queue_limit`` calls wait for a worker; one more is refused. A call whose kernels are
    still being compiled is refused too, and told how long that takes.

    Batches have workers of their own, which the system lets run when nobody else wants to: a request of a person never
    waits for one.
    """

    def __init__(self, settings: PoolSettings | None = None, template: Template | None = None) -> None:
        self._settings = given = settings or PoolSettings()
        self._template = template or Template(given.preload)
        self._warming = KernelWarming(self._template, given.told) if given.kernels else None
        worker = WorkerSettings(given.entry, given.load, given.idle_work, given.memory_bytes, given.niceness)
        behind = WorkerSettings(
            given.background_entry, given.load, calls.nothing, given.memory_bytes, given.background_niceness
        )
        self._front = Lane(worker, self._template, given.workers, "solve")
        self._behind = Lane(behind, self._template, given.background_workers, "batch")
        self._lanes = (self._front, self._behind)
        self._keeper = threading.Thread(target=self._keep, name="keeper", daemon=True)
        self._wake = threading.Event()
        self._closed = False

    def start(self) -> None:
        if self._keeper.ident is None:
            self._keeper.start()

    @property
    def ready(self) -> bool:
        """Whether at least one worker is there, by the look of it now."""
        return any(place.ready for place in self._front.places)

    @property
    def warmths(self) -> list[Warmth]:
        """How far the kernels of every kind are."""
        return [] if self._warming is None else self._warming.warmths()

    async def _check_warm(self, kind_slug: str, mode: str) -> None:
        """Raises Warming where the kernels of that kind and mode are still being compiled."""
        if self._warming is None:
            return
        while not self._warming.known and not self._closed:
            await asyncio.sleep(_LOOK_S / 10)
        self._warming.check(kind_slug, mode)

    def wait_until_warm(self, timeout: float | None = None) -> bool:
        """Until all kernels are there; False if that took longer."""
        return self._warming is None or self._warming.wait(timeout)

    @property
    def worker_pids(self) -> list[int]:
        return [place.pid for lane in self._lanes for place in lane.places if place.pid is not None]

    @property
    def template_pid(self) -> int | None:
        return self._template.pid

    @property
    def pending(self) -> int:
        """Calls that run or wait, those of batches not counted."""
        return self._front.pending

    @property
    def background_workers(self) -> int:
        return self._behind.workers

    async def run(
        self,
        kind_slug: str,
        mode: str,
        payload: bytes,
        budget_s: float = DEFAULT_BUDGET_S,
        report: Report = to_nobody,
    ) -> Answer:
        if self._closed:
            raise ExecutorClosed("the executor is closing")
        self.start()
        await self._check_warm(kind_slug, mode)
        if self._front.pending >= self._settings.workers + self._settings.queue_limit:
            raise Busy(f"{self._front.pending} solves run or wait already")
        return await self._await(self._front, Call(kind_slug, mode, payload, budget_s, report))

    async def run_in_background(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        if self._closed:
            raise ExecutorClosed("the executor is closing")
        self.start()
        await self._check_warm(kind_slug, mode)
        return await self._await(self._behind, Call(kind_slug, mode, payload, budget_s))

    async def _await(self, lane: Lane, call: Call) -> Any:
        lane.pending += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(lane.threads, self._solve, lane, call)
        except asyncio.CancelledError:
            call.cancel()
            task = asyncio.current_task()
            if task is not None and not task.cancelling():
                raise ExecutorClosed("the executor closed before the solve began") from None
            raise
        finally:
            lane.pending -= 1

    def close(self) -> None:
        self._closed = True
        if self._warming is not None:
            self._warming.close()
        for lane in self._lanes:
            for place in lane.places:
                place.close()
        self._template.close()
        self._wake.set()
        for lane in self._lanes:
            lane.threads.shutdown(wait=True, cancel_futures=True)
        if self._keeper.ident is not None:
            self._keeper.join()

    def _solve(self, lane: Lane, call: Call) -> Any:
        place = lane.take()
        try:
            if self._closed or not call.begin(place):
                raise ExecutorClosed("the call was given up before it began")
            generation = self._template.generation
            try:
                return place.solve(call)
            except WorkerCrashed as crash:
                if self._closed:
                    raise ExecutorClosed("the executor closed during the solve") from crash
                if call.cancelled or not self._template_fell(generation):
                    raise
                # The worker went down with the template, not for its call: once more, on another one.
                return place.solve(call)
            finally:
                call.end()
                self._wake.set()
        finally:
            lane.give_back(place)

    def _template_fell(self, generation: int) -> bool:
        end = time.monotonic() + _LOOK_S
        while self._template.alive and self._template.generation == generation and time.monotonic() < end:
            time.sleep(_LOOK_S / 10)
        return not self._template.alive or self._template.generation != generation

    def _keep(self) -> None:
        """See to it that the template lives and that every free place has a worker.

        One thread for as long as the pool lives: to the system, its end is the end of the template's parent.
        """
        begun, loading = -_BETWEEN_STARTS_S, 0
        if self._warming is not None:
            self._warming.start()
        while not self._closed:
            if not self._template.alive and time.monotonic() - begun > _BETWEEN_STARTS_S:
                begun = time.monotonic()
                if self._template.generation:
                    logger.error("template_ended")
                try:
                    self._template.start()
                except OSError as error:  # no descriptor to spare, no process, no memory: once more in a second
                    logger.error("template_not_started", reason=str(error))
            try:
                for lane in self._lanes:
                    for _ in range(lane.count_lost()):
                        lane.threads.submit(self._prepare_one, lane)
            except RuntimeError:  # closed a moment ago
                return
            if loading != self._template.generation and self.ready and self.wait_until_warm(0.0):
                loading = self._template.generation
                with contextlib.suppress(JobError):  # it ended a moment ago, and is started again
                    self._template.load_when_idle()
            self._wake.wait(_LOOK_S)
            self._wake.clear()

    def _prepare_one(self, lane: Lane) -> None:
        place = lane.take_lost()
        try:
            if place is not None and not self._closed:
                place.prepare()
        except JobError as error:
            # The next call on this place tries again and reports what it finds.
            if not self._closed:
                logger.warning("worker_did_not_start", reason=str(error))
                time.sleep(_LOOK_S)
        finally:
            lane.prepared(place)
