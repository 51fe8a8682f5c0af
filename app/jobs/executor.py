"""The executor interface, and the pool of worker processes that implements it on one machine."""

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
from app.designs.progress import Report, ignore_progress
from app.jobs import calls
from app.jobs.errors import Busy, ExecutorClosed, JobError, WorkerCrashed
from app.jobs.fork_server import ForkServer
from app.jobs.warming import KernelWarming, StatusListener, WarmupStatus, ignore_status
from app.jobs.worker import Entry, Load, WorkerSettings
from app.jobs.worker_slot import Call, WorkerSlot
from app.logging import get_logger

logger = get_logger(__name__)

DEFAULT_BUDGET_S = 10.0
DEFAULT_QUEUE_LIMIT = 64

_POLL_INTERVAL_S = 0.2
_RESTART_INTERVAL_S = 1.0


class Executor(Protocol):
    """Runs registered jobs outside the service process."""

    @property
    def ready(self) -> bool:
        """Whether a call would be answered now."""

    @property
    def warmup_status(self) -> list[WarmupStatus]:
        """Warm-up status of every kind; empty if nothing has to be compiled."""

    def start(self) -> None:
        """Start warming up, without blocking."""

    async def run(
        self,
        kind_slug: str,
        mode: str,
        payload: bytes,
        budget_s: float = DEFAULT_BUDGET_S,
        report: Report = ignore_progress,
    ) -> Answer:
        """Return the answer to a request given as JSON; ``report`` is called from another thread with the progress.

        Raises Busy if the queue is full, BudgetExceeded after ``budget_s`` seconds of wall-clock time (queueing not
        included), MemoryExceeded, WorkerCrashed or SolveFailed. Cancelling the awaiting task kills the solve.
        """

    async def run_in_background(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        """Like ``run`` for a chunk of a batch, on low-priority workers; waits for a free worker without limit."""

    @property
    def background_workers(self) -> int:
        """Number of batch chunks that can run at once."""

    def close(self) -> None:
        """Kill every solve and every worker."""


@dataclass(frozen=True)
class PoolSettings:
    """Size and limits of a process pool.

    ``entry`` and ``load`` are module-level functions. The fork server imports the module ``preload``, whose
    ``load_step_by_step`` is its idle work. With ``kernels``, calls are refused until their kernels are compiled.
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
    on_status: StatusListener = ignore_status
    background_workers: int = 0
    background_entry: Entry = calls.answer
    background_niceness: int = 19


class Lane:
    """A group of worker slots with its own threads and queue; lanes never wait for each other."""

    def __init__(self, worker: WorkerSettings, fork_server: ForkServer, workers: int, name: str) -> None:
        self.workers = workers
        self.slots = [WorkerSlot(worker, fork_server) for _ in range(workers)]
        # One thread per worker blocks on its pipe; with as many slots as threads, a running thread always finds one.
        self.threads = ThreadPoolExecutor(max(1, workers), thread_name_prefix=name)
        self.pending, self._preparing = 0, 0
        self._idle = list(self.slots)
        self._lock = threading.Lock()

    def acquire(self) -> WorkerSlot:
        """Take an idle slot, preferably one whose worker runs, of these the last used: its memory is in the caches."""
        with self._lock:
            for slot in reversed(self._idle):
                if slot.ready:
                    self._idle.remove(slot)
                    return slot
            return self._idle.pop()

    def release(self, slot: WorkerSlot) -> None:
        with self._lock:
            self._idle.append(slot)

    def claim_missing(self) -> int:
        """Count idle slots without a live worker that nobody is starting one for, and mark them as being started."""
        with self._lock:
            lost = sum(not slot.ready for slot in self._idle) - self._preparing
            self._preparing += max(0, lost)
        return lost

    def acquire_empty(self) -> WorkerSlot | None:
        """Take an idle slot without a live worker, if any."""
        with self._lock:
            slot = next((slot for slot in self._idle if not slot.ready), None)
            if slot is not None:
                self._idle.remove(slot)
        return slot

    def preparation_done(self, slot: WorkerSlot | None) -> None:
        """Finish an attempt to start a worker and return its slot."""
        with self._lock:
            self._preparing -= 1
            if slot is not None:
                self._idle.append(slot)


class ProcessPool:
    """Worker processes on this machine, forked from a server that has already imported the solvers.

    A worker that overruns its budget, crashes or runs out of memory is killed and replaced; so is the fork server.
    Other solves are not affected. At most ``queue_limit`` calls wait; a further one is refused, and so is a call whose
    kernels are still being compiled.

    Batches have their own workers at the lowest scheduling priority, so an interactive request never waits for one.
    """

    def __init__(self, settings: PoolSettings | None = None, fork_server: ForkServer | None = None) -> None:
        self._settings = settings = settings or PoolSettings()
        self._fork_server = fork_server or ForkServer(settings.preload)
        self._warming = KernelWarming(self._fork_server, settings.on_status) if settings.kernels else None
        worker = WorkerSettings(
            settings.entry, settings.load, settings.idle_work, settings.memory_bytes, settings.niceness
        )
        background = WorkerSettings(
            settings.background_entry,
            settings.load,
            calls.no_idle_work,
            settings.memory_bytes,
            settings.background_niceness,
        )
        self._foreground = Lane(worker, self._fork_server, settings.workers, "solve")
        self._background = Lane(background, self._fork_server, settings.background_workers, "batch")
        self._lanes = (self._foreground, self._background)
        self._supervisor = threading.Thread(target=self._supervise, name="supervisor", daemon=True)
        self._wake = threading.Event()
        self._closed = False

    def start(self) -> None:
        if self._supervisor.ident is None:
            self._supervisor.start()

    @property
    def ready(self) -> bool:
        """Whether at least one worker is alive."""
        return any(slot.ready for slot in self._foreground.slots)

    @property
    def warmup_status(self) -> list[WarmupStatus]:
        """Warm-up status of every kind."""
        return [] if self._warming is None else self._warming.statuses()

    async def _check_kernels(self, kind_slug: str, mode: str) -> None:
        """Raise Warming while the kernels of this kind and mode are being compiled."""
        if self._warming is None:
            return
        while not self._warming.known and not self._closed:
            await asyncio.sleep(_POLL_INTERVAL_S / 10)
        self._warming.check(kind_slug, mode)

    def wait_until_warm(self, timeout: float | None = None) -> bool:
        """Block until all kernels are compiled; False on timeout."""
        return self._warming is None or self._warming.wait(timeout)

    @property
    def worker_pids(self) -> list[int]:
        return [slot.pid for lane in self._lanes for slot in lane.slots if slot.pid is not None]

    @property
    def fork_server_pid(self) -> int | None:
        return self._fork_server.pid

    @property
    def pending(self) -> int:
        """Number of running and waiting calls, batches excluded."""
        return self._foreground.pending

    @property
    def background_workers(self) -> int:
        return self._background.workers

    async def run(
        self,
        kind_slug: str,
        mode: str,
        payload: bytes,
        budget_s: float = DEFAULT_BUDGET_S,
        report: Report = ignore_progress,
    ) -> Answer:
        if self._closed:
            raise ExecutorClosed("the executor is closing")
        self.start()
        await self._check_kernels(kind_slug, mode)
        if self._foreground.pending >= self._settings.workers + self._settings.queue_limit:
            raise Busy(f"{self._foreground.pending} solves run or wait already")
        return await self._await(self._foreground, Call(kind_slug, mode, payload, budget_s, report))

    async def run_in_background(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        if self._closed:
            raise ExecutorClosed("the executor is closing")
        self.start()
        await self._check_kernels(kind_slug, mode)
        return await self._await(self._background, Call(kind_slug, mode, payload, budget_s))

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
            for slot in lane.slots:
                slot.close()
        self._fork_server.close()
        self._wake.set()
        for lane in self._lanes:
            lane.threads.shutdown(wait=True, cancel_futures=True)
        if self._supervisor.ident is not None:
            self._supervisor.join()

    def _solve(self, lane: Lane, call: Call) -> Any:
        slot = lane.acquire()
        try:
            if self._closed or not call.begin(slot):
                raise ExecutorClosed("the call was cancelled before it began")
            generation = self._fork_server.generation
            try:
                return slot.solve(call)
            except WorkerCrashed as crash:
                if self._closed:
                    raise ExecutorClosed("the executor closed during the solve") from crash
                if call.cancelled or not self._fork_server_restarted(generation):
                    raise
                # The worker died with the fork server, not because of its call: retry once on a new one.
                return slot.solve(call)
            finally:
                call.end()
                if not slot.ready:
                    self._wake.set()
        finally:
            lane.release(slot)

    def _fork_server_restarted(self, generation: int) -> bool:
        end = time.monotonic() + _POLL_INTERVAL_S
        while self._fork_server.alive and self._fork_server.generation == generation and time.monotonic() < end:
            time.sleep(_POLL_INTERVAL_S / 10)
        return not self._fork_server.alive or self._fork_server.generation != generation

    def _supervise(self) -> None:
        """Restart the fork server when it dies and give every idle slot a worker.

        Runs in one thread for the lifetime of the pool: Linux sends the parent-death signal when the thread that
        started a process ends.
        """
        last_start, loaded_generation = -_RESTART_INTERVAL_S, 0
        if self._warming is not None:
            self._warming.start()
        while not self._closed:
            if not self._fork_server.alive and time.monotonic() - last_start > _RESTART_INTERVAL_S:
                last_start = time.monotonic()
                if self._fork_server.generation:
                    logger.error("fork_server_exited")
                try:
                    self._fork_server.start()
                except OSError as error:  # out of file descriptors, processes or memory: retried in a second
                    logger.error("fork_server_start_failed", reason=str(error))
            try:
                for lane in self._lanes:
                    for _ in range(lane.claim_missing()):
                        lane.threads.submit(self._start_worker, lane)
            except RuntimeError:  # the thread pools were shut down meanwhile
                return
            if loaded_generation != self._fork_server.generation and self.ready and self.wait_until_warm(0.0):
                loaded_generation = self._fork_server.generation
                with contextlib.suppress(JobError):  # it died meanwhile and will be restarted
                    self._fork_server.load_kernels_when_idle()
            self._wake.wait(_POLL_INTERVAL_S)
            self._wake.clear()

    def _start_worker(self, lane: Lane) -> None:
        slot = lane.acquire_empty()
        try:
            if slot is not None and not self._closed:
                slot.prepare()
        except JobError as error:
            # The next call on this slot retries and reports its error.
            if not self._closed:
                logger.warning("worker_start_failed", reason=str(error))
                time.sleep(_POLL_INTERVAL_S)
        finally:
            lane.preparation_done(slot)
