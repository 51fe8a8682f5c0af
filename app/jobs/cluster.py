"""Run batch chunks on a Dask cluster behind the executor interface; interactive requests stay on this machine.

A task on a cluster worker passes its chunk to a local process pool there, so that it can be killed like any other. A
failure is returned as a value, because not every exception can be pickled.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from app.jobs.errors import BudgetExceeded, Busy, JobError, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.executor import PoolSettings, ProcessPool
from app.jobs.fork_server import ForkServer
from app.logging import get_logger

logger = get_logger(__name__)

_TIMEOUT_S = 60.0


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


_hosts: dict[PoolSettings, _Host] = {}
_hosts_lock = threading.Lock()


def solve(settings: PoolSettings, kind: str, mode: str, payload: bytes, budget_s: float) -> Any:
    """Run a chunk in this cluster worker's pool; the function that Dask calls."""
    with _hosts_lock:
        if settings not in _hosts:
            _hosts[settings] = _Host(settings)
    try:
        return _hosts[settings].run(kind, mode, payload, budget_s)
    except JobError as error:
        return JobFailure(type(error).__name__, str(error))


def close_hosts() -> None:
    """Close the pools of this process."""
    with _hosts_lock:
        for host in _hosts.values():
            host.pool.close()
        _hosts.clear()


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

    @property
    def background_workers(self) -> int:
        """Threads of the cluster's workers; at least one, so that a batch waits for the first worker to join."""
        workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
        return max(1, sum(worker["nthreads"] for worker in workers))

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
        with contextlib.suppress(Exception):
            self._executor.shutdown(wait=False)
            self._client.close(timeout=2)
        super().close()


async def run_worker(scheduler: str, workers: int) -> None:
    """Serve a scheduler until this process is stopped; reconnects after a connection loss."""
    from distributed import Worker

    while True:
        try:
            async with Worker(scheduler, nthreads=workers, name=None) as worker:
                await worker.finished()
        except (OSError, TimeoutError) as error:
            logger.warning("scheduler_unreachable", reason=str(error))
        await asyncio.sleep(1.0)
