"""Run batch chunks on a Dask cluster behind the executor interface; interactive requests stay on this machine.

A task on a cluster worker passes its chunk to a local process pool there, so that it can be killed like any other. A
failure is returned as a value, because not every exception can be pickled.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

from app.jobs.errors import BudgetExceeded, Busy, JobError, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.executor import PoolSettings, ProcessPool
from app.jobs.fork_server import ForkServer
from app.logging import get_logger

logger = get_logger(__name__)

_TIMEOUT_S, _COUNT_INTERVAL_S = 60.0, 1.0


@dataclass(frozen=True)
class JobFailure:
    """A chunk that failed: name of the error class, and its message."""

    error: str
    message: str


class _Host:
    """The process pool of one cluster worker, with its own event loop."""

    def __init__(self, settings: PoolSettings) -> None:
        self.pool = ProcessPool(settings)
        self.pool.start()
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, name="chunks", daemon=True).start()

    def run(self, kind: str, mode: str, payload: bytes, budget_s: float) -> Any:
        call = self.pool.run_in_background(kind, mode, payload, budget_s)
        return asyncio.run_coroutine_threadsafe(call, self._loop).result()


_host: _Host | None = None
_host_lock = threading.Lock()


def _started(settings: PoolSettings) -> _Host:
    """The pool of this process, started by the first call."""
    global _host
    with _host_lock:
        _host = _host or _Host(settings)
        return _host


def solve(settings: PoolSettings, kind: str, mode: str, payload: bytes, budget_s: float) -> Any:
    """Run a chunk in this cluster worker's pool, which has a process for each of its threads; the function that Dask
    calls. A worker that `crankwright worker` did not start gets its pool, with ``settings``, here."""
    from distributed import get_worker

    try:
        here = replace(settings, background_workers=get_worker().state.nthreads)
        return _started(here).run(kind, mode, payload, budget_s)
    except JobError as error:
        return JobFailure(type(error).__name__, str(error))


def close_host() -> None:
    """Close the pool of this process."""
    global _host
    with _host_lock:
        if _host is not None:
            _host.pool.close()
        _host = None


def to_exception(ended: JobFailure, budget_s: float) -> JobError:
    """The exception that a failure stands for."""
    if ended.error == BudgetExceeded.__name__:
        return BudgetExceeded(budget_s)
    if ended.error == SolveFailed.__name__:
        return SolveFailed("an error", ended.message)
    if ended.error == WorkerCrashed.__name__:
        return WorkerCrashed(None)
    return {MemoryExceeded.__name__: MemoryExceeded}.get(ended.error, Busy)(ended.message)


class ClusterPool(ProcessPool):
    """Local workers for interactive requests, those of a Dask cluster for batches. Needs the extra [cluster].

    Any failure of the cluster itself is raised as Busy, so that the chunk is retried.
    """

    def __init__(
        self, settings: PoolSettings, scheduler: str, cluster_settings: PoolSettings, fork_server: ForkServer | None
    ) -> None:
        super().__init__(settings, fork_server)
        from distributed import Client

        self._cluster_settings = cluster_settings
        self._client = Client(scheduler, set_as_default=False, timeout=_TIMEOUT_S, name="crankwright")
        self._executor = self._client.get_executor(pure=False, retries=0)
        self._threads, self._over = self._count(), threading.Event()
        threading.Thread(target=self._keep_count, name="cluster", daemon=True).start()

    def _count(self) -> int:
        return self._client.scheduler_info(n_workers=0)["total_threads"]

    def _keep_count(self) -> None:
        """Ask the scheduler in a thread, since the event loop cannot wait for its answer."""
        while not self._over.wait(_COUNT_INTERVAL_S):
            with contextlib.suppress(Exception):  # the scheduler is lost; the client connects again
                self._threads = self._count()

    @property
    def background_workers(self) -> int:
        """Threads of the cluster's workers; at least one, so that a batch waits for the first worker to join."""
        return max(1, self._threads)

    async def run_in_background(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        future: Future[Any] | None = None
        try:
            future = self._executor.submit(solve, self._cluster_settings, kind_slug, mode, payload, budget_s)
            found = await asyncio.wait_for(asyncio.wrap_future(future), 2 * budget_s + _TIMEOUT_S)
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task is not None and task.cancelling():
                raise
            raise Busy("the cluster dropped the chunk") from None
        except Exception as error:
            logger.warning("cluster_task_failed", reason=repr(error))
            raise Busy("the cluster does not answer") from error
        finally:
            if future is not None:
                future.cancel()
        if isinstance(found, JobFailure):
            raise to_exception(found, budget_s)
        return found

    def close(self) -> None:
        self._over.set()
        with contextlib.suppress(Exception):
            self._executor.shutdown(wait=False)
            self._client.close(timeout=2)
        super().close()


async def run_worker(scheduler: str, settings: PoolSettings) -> None:
    """Serve a scheduler until this process is stopped, with a process for each of the pool's background workers;
    reconnects after a connection loss."""
    import dask
    from distributed import Worker

    # The chunks' processes do the work, and limit their own memory. Here threads only wait for them: Dask's profiler
    # would sample these, its tick wake the loop fifty times a second, and its monitor read this process's memory ten
    # times, together for a hundredth of a core.
    dask.config.set({"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "500ms"})
    _started(settings)
    try:
        while True:
            try:
                async with Worker(scheduler, nthreads=settings.background_workers, memory_limit=0) as worker:
                    await worker.finished()
            except (OSError, TimeoutError) as error:
                logger.warning("scheduler_unreachable", reason=str(error))
            await asyncio.sleep(1.0)
    finally:
        close_host()
