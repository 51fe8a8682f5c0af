"""Solves outside the service process, behind one interface."""

from __future__ import annotations

import asyncio
import contextlib
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

from app.designs.kind import Answer
from app.designs.progress import Report, to_nobody
from app.jobs import calls
from app.jobs.errors import Busy, ExecutorClosed, JobError, WorkerCrashed
from app.jobs.pool import Call, Place, begin
from app.jobs.worker import Entry, WorkerSettings
from app.logging import get_logger

logger = get_logger(__name__)

DEFAULT_BUDGET_S = 10.0
DEFAULT_MEMORY_BYTES = 2 << 30
DEFAULT_QUEUE_LIMIT = 64


class Executor(Protocol):
    """Runs jobs of the registry somewhere that cannot hurt the service."""

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

    def close(self) -> None:
        """End every solve and every worker."""


@dataclass(frozen=True)
class PoolSettings:
    """Size and limits of a process pool; ``entry`` and ``warm_up`` are module-level functions."""

    workers: int = os.cpu_count() or 1
    queue_limit: int = DEFAULT_QUEUE_LIMIT
    memory_bytes: int = DEFAULT_MEMORY_BYTES
    niceness: int = 10
    entry: Entry = calls.answer
    warm_up: calls.WarmUp = calls.warm_up


class ProcessPool:
    """Warm worker processes on this machine, forked from a server that has the solvers imported.

    A worker that overruns its budget, dies, or runs out of memory is killed and replaced; the other solves
    go on. At most ``queue_limit`` calls wait for a worker; one more is refused.
    """

    def __init__(self, settings: PoolSettings | None = None) -> None:
        self._settings = settings or PoolSettings()
        worker = WorkerSettings(
            self._settings.entry, self._settings.warm_up, self._settings.memory_bytes, self._settings.niceness
        )
        self._places = [Place(worker) for _ in range(self._settings.workers)]
        self._free = list(self._places)
        self._free_lock = threading.Lock()
        # One thread per worker, waiting on its pipe: as many places as threads, so there is always a free one.
        self._threads = ThreadPoolExecutor(self._settings.workers, thread_name_prefix="solve")
        self._pending = 0
        self._closed = False

    def start(self) -> None:
        begin()
        for _ in self._places:
            self._threads.submit(self._prepare_one)

    @property
    def ready(self) -> bool:
        """Whether at least one worker is warm."""
        return any(place.ready for place in self._places)

    @property
    def worker_pids(self) -> list[int]:
        return [place.pid for place in self._places if place.pid is not None]

    @property
    def pending(self) -> int:
        """Calls that run or wait."""
        return self._pending

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
        if self._pending >= self._settings.workers + self._settings.queue_limit:
            raise Busy(f"{self._pending} solves run or wait already")
        call = Call(kind_slug, mode, payload, budget_s, report)
        self._pending += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._threads, self._solve, call)
        except asyncio.CancelledError:
            call.cancel()
            raise
        finally:
            self._pending -= 1

    def close(self) -> None:
        self._closed = True
        for place in self._places:
            place.close()
        self._threads.shutdown(wait=True, cancel_futures=True)

    def _take(self, ready: bool) -> Place:
        """A free place, a warm one or one that still lacks its worker, as wanted if there is such a one."""
        with self._free_lock:
            for place in self._free:
                if place.ready is ready:
                    self._free.remove(place)
                    return place
            return self._free.pop()

    def _give_back(self, place: Place) -> None:
        with self._free_lock:
            self._free.append(place)

    def _solve(self, call: Call) -> Answer:
        place = self._take(ready=True)
        try:
            if self._closed or not call.begin(place):
                raise ExecutorClosed("the call was given up before it began")
            try:
                return place.solve(call)
            except WorkerCrashed as crash:
                if self._closed:
                    raise ExecutorClosed("the executor closed during the solve") from crash
                raise
            finally:
                call.end()
                self._replace_if_gone(place)
        finally:
            self._give_back(place)

    def _replace_if_gone(self, place: Place) -> None:
        """Start the next worker now, not when the next call waits for it."""
        if not place.ready and not self._closed:
            with contextlib.suppress(RuntimeError):  # closed a moment ago
                self._threads.submit(self._prepare_one)

    def _prepare_one(self) -> None:
        place = self._take(ready=False)
        try:
            if not self._closed:
                place.prepare()
        except JobError as error:
            # The next call on this place tries again and reports what it finds.
            if not self._closed:
                logger.warning("worker_did_not_start", reason=str(error))
        finally:
            self._give_back(place)
