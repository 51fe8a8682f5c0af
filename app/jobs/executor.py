"""The executor interface, and the pool of worker processes that implements it on one machine."""

from __future__ import annotations

import asyncio
import contextlib
import os
import threading
import time
from dataclasses import dataclass
from typing import Any, Protocol

from app.designs.progress import Report, ignore_progress
from app.jobs import calls
from app.jobs.errors import Busy, ExecutorClosed, JobError, WorkerCrashed
from app.jobs.fork_server import ForkServer
from app.jobs.lane import Lane
from app.jobs.warming import KernelWarming, StatusListener, WarmupStatus, ignore_status
from app.jobs.worker import Entry, Load, WorkerSettings
from app.jobs.worker_process import Call, Worker
from app.logging import get_logger

logger = get_logger(__name__)

DEFAULT_BUDGET_S = 10.0
DEFAULT_QUEUE_LIMIT = 64

_POLL_INTERVAL_S = 0.2
_RESTART_INTERVAL_S = 1.0
_RESOURCES_RETRY_S = 5.0


class Executor(Protocol):
    """Runs registered jobs outside the service process."""

    @property
    def ready(self) -> bool:
        """Whether a call would be answered now."""

    @property
    def warm(self) -> bool:
        """Whether all kernels have been compiled, or have failed to; once true, it stays so."""

    @property
    def warmup_status(self) -> list[WarmupStatus]:
        """Warm-up status of every kind; empty if nothing has to be compiled, or while it is not known what has to."""

    def is_warm(self, kind_slug: str, mode: str) -> bool:
        """Whether the kernels of this kind and mode are compiled."""

    def start(self) -> None:
        """Start warming up, without blocking."""

    async def run(
        self,
        kind_slug: str,
        mode: str,
        payload: bytes,
        budget_s: float = DEFAULT_BUDGET_S,
        report: Report = ignore_progress,
    ) -> Any:
        """Return what the entry makes of a request given as JSON; ``report`` is called with the progress.

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

    ``entry`` and ``load`` are module-level functions. The fork server imports the module ``preload``. With ``kernels``,
    calls are refused until their kernels are compiled; then the fork server loads them, by the module's
    ``load_step_by_step``, and the workers are replaced by others that have them.
    """

    workers: int = os.cpu_count() or 1
    queue_limit: int = DEFAULT_QUEUE_LIMIT
    memory_bytes: int = 2 << 30
    niceness: int = 10
    entry: Entry = calls.answer
    load: Load = calls.load
    preload: str = "app.jobs.preload"
    kernels: bool = True
    on_status: StatusListener = ignore_status
    background_workers: int = 0
    background_entry: Entry = calls.answer
    background_niceness: int = 19


class ProcessPool:
    """Worker processes on this machine, forked from a server that has already imported the solvers.

    A worker that overruns its budget, crashes or runs out of memory is killed and replaced; so is the fork server.
    Other solves are not affected. At most ``queue_limit`` calls wait; a further one is refused, and so is a call whose
    kernels are still being compiled.

    Batches have their own workers at the lowest scheduling priority, so an interactive request never waits for one.
    """

    def __init__(self, settings: PoolSettings | None = None, fork_server: ForkServer | None = None) -> None:
        settings = settings or PoolSettings()
        self._fork_server = fork_server or ForkServer(settings.preload)
        self._warming = KernelWarming(self._fork_server, settings.on_status) if settings.kernels else None
        memory = settings.memory_bytes
        worker = WorkerSettings(settings.entry, settings.load, memory, settings.niceness)
        background = WorkerSettings(settings.background_entry, settings.load, memory, settings.background_niceness)
        self._wake = threading.Event()
        most = settings.workers + settings.queue_limit
        self._foreground = Lane(worker, settings.workers, self._wake.set, most)
        self._background = Lane(background, settings.background_workers, self._wake.set)
        self._lanes = (self._foreground, self._background)
        self._supervisor = threading.Thread(target=self._supervise, name="supervisor", daemon=True)
        self._closed = False

    def start(self) -> None:
        if self._supervisor.ident is None:
            self._supervisor.start()

    @property
    def ready(self) -> bool:
        """Whether at least one worker is alive."""
        return self._foreground.ready

    @property
    def warm(self) -> bool:
        return self.wait_until_warm(0.0)

    def is_warm(self, kind_slug: str, mode: str) -> bool:
        return self._warming is None or self._warming.is_warm(kind_slug, mode)

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
    def _kernels_there(self) -> bool:
        """Whether there are kernels to load: they are compiled, and a worker serves meanwhile."""
        return self._warming is not None and self._warming.wait(0.0) and self.ready

    @property
    def worker_pids(self) -> list[int]:
        return [worker.pid for lane in self._lanes for worker in lane.workers]

    @property
    def pending(self) -> int:
        """Number of running and waiting calls, batches excluded."""
        return self._foreground.pending

    @property
    def background_workers(self) -> int:
        return self._background.wanted

    async def run(
        self,
        kind_slug: str,
        mode: str,
        payload: bytes,
        budget_s: float = DEFAULT_BUDGET_S,
        report: Report = ignore_progress,
    ) -> Any:
        return await self._solve(self._foreground, Call(kind_slug, mode, payload, budget_s, report))

    async def run_in_background(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        return await self._solve(self._background, Call(kind_slug, mode, payload, budget_s))

    async def _solve(self, lane: Lane, call: Call) -> Any:
        if self._closed:
            raise ExecutorClosed("the executor is closing")
        self.start()
        await self._check_kernels(call.kind_slug, call.mode)
        if lane.pending >= lane.limit:
            raise Busy(f"{lane.pending} solves run or wait already")
        lane.pending += 1
        try:
            for last in (False, True):
                worker = await lane.acquire()
                try:
                    return await worker.solve(call)
                except (EOFError, OSError):  # the other end of its pipe is closed
                    if self._closed:
                        raise ExecutorClosed("the executor closed during the solve") from None
                finally:
                    lane.release(worker)
                    if self._closed:
                        self._reap(lane)
                code = await asyncio.shield(asyncio.wrap_future(worker.exit_code))
                # Once more if it died before its call began, or with the fork server.
                if last or (worker.accepted and code is not None):
                    raise WorkerCrashed(code)
        finally:
            lane.pending -= 1

    def close(self) -> None:
        self._closed = True
        if self._warming is not None:
            self._warming.close()
        for lane in self._lanes:
            lane.close()
        self._fork_server.close()
        self._wake.set()
        if self._supervisor.ident is not None:
            self._supervisor.join()
        for lane in self._lanes:
            self._reap(lane)

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
                    for lane in self._lanes:
                        lane.refuse(_no_process(error))
            for lane in self._lanes:
                self._reap(lane)
                self._start_workers(lane)
            # A call needs the processor more, and its worker loads what it needs by itself.
            if loaded_generation != self._fork_server.generation and not self.pending and self._kernels_there:
                with contextlib.suppress(JobError):  # it died meanwhile and will be restarted
                    if not self._fork_server.load_next():
                        loaded_generation = self._fork_server.generation
                        for lane in self._lanes:
                            lane.renew()
                    self._wake.set()
            self._wake.wait(_POLL_INTERVAL_S)
            self._wake.clear()

    @staticmethod
    def _reap(lane: Lane) -> None:
        for worker in lane.take_lost():
            worker.reap()

    def _start_workers(self, lane: Lane) -> None:
        while not self._closed and self._fork_server.alive and lane.missing():
            try:
                lane.add(Worker.start(self._fork_server, lane.settings))
            except OSError as error:  # out of file descriptors, processes or memory
                lane.refuse(_no_process(error))
                return
            except WorkerCrashed as error:
                if not self._closed:
                    logger.warning("worker_start_failed", reason=str(error))
                return


def _no_process(error: OSError) -> Busy:
    return Busy(f"no worker process can be started: {error.strerror}", _RESOURCES_RETRY_S)
