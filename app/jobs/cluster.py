"""Pieces of batches on a Dask cluster, behind the same interface; single requests stay on this machine.

A task on a cluster's worker hands its piece to a pool of processes of its own there, so that it can be killed as
everywhere else; what became of it comes back as a value, for not every error survives the journey.
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
from app.jobs.template import Template
from app.logging import get_logger

logger = get_logger(__name__)

_PATIENCE_S = 60.0


@dataclass(frozen=True)
class Ended:
    """How a piece ended without an answer: the name of the error, and what it tells."""

    error: str
    told: str


class _Host:
    """The pool of one process of the cluster, with an event loop of its own."""

    def __init__(self, settings: PoolSettings) -> None:
        self.pool = ProcessPool(settings)
        self.pool.start()
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, name="pieces", daemon=True).start()

    def run(self, kind: str, mode: str, payload: bytes, budget_s: float) -> Any:
        call = self.pool.run_in_background(kind, mode, payload, budget_s)
        return asyncio.run_coroutine_threadsafe(call, self._loop).result()


_hosts: dict[PoolSettings, _Host] = {}
_hosts_lock = threading.Lock()


def solve(settings: PoolSettings, kind: str, mode: str, payload: bytes, budget_s: float) -> Any:
    """What runs on the cluster: solve a piece in a process of this host's."""
    with _hosts_lock:
        if settings not in _hosts:
            _hosts[settings] = _Host(settings)
    try:
        return _hosts[settings].run(kind, mode, payload, budget_s)
    except JobError as error:
        return Ended(type(error).__name__, str(error))


def close_hosts() -> None:
    """End the pools of this process."""
    with _hosts_lock:
        for host in _hosts.values():
            host.pool.close()
        _hosts.clear()


def raised(ended: Ended, budget_s: float) -> JobError:
    """The error again."""
    if ended.error == BudgetExceeded.__name__:
        return BudgetExceeded(budget_s)
    if ended.error == SolveFailed.__name__:
        return SolveFailed("an error", ended.told)
    if ended.error == WorkerCrashed.__name__:
        return WorkerCrashed(None)
    return {MemoryExceeded.__name__: MemoryExceeded}.get(ended.error, Busy)(ended.told)


class ClusterPool(ProcessPool):
    """Workers on this machine for people, those of a Dask cluster for batches. Needs the extra [cluster].

    Whatever happens to the cluster, a piece comes back as busy and is tried again.
    """

    def __init__(self, settings: PoolSettings, scheduler: str, there: PoolSettings, template: Template | None) -> None:
        super().__init__(settings, template)
        from distributed import Client

        self._there = there
        self._client = Client(scheduler, set_as_default=False, timeout=_PATIENCE_S, name="crankwright")
        self._executor = self._client.get_executor(pure=False, retries=0)

    @property
    def background_workers(self) -> int:
        """Threads of the cluster's workers; at least one, so that a batch waits for the first to join."""
        workers = self._client.scheduler_info(n_workers=-1)["workers"].values()
        return max(1, sum(worker["nthreads"] for worker in workers))

    async def run_in_background(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        future: Future[Any] | None = None
        try:
            future = self._executor.submit(solve, self._there, kind_slug, mode, payload, budget_s)
            found = await asyncio.wait_for(asyncio.wrap_future(future), 2 * budget_s + _PATIENCE_S)
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task is not None and task.cancelling():
                raise
            raise Busy("the cluster gave the piece up") from None
        except Exception as error:
            logger.warning("cluster_lost_a_piece", reason=repr(error))
            raise Busy("the cluster does not answer") from error
        finally:
            if future is not None:
                future.cancel()
        if isinstance(found, Ended):
            raise raised(found, budget_s)
        return found

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self._executor.shutdown(wait=False)
            self._client.close(timeout=2)
        super().close()


async def join(scheduler: str, workers: int) -> None:
    """Work for a scheduler until this process is ended; a scheduler that went away is waited for."""
    from distributed import Worker

    while True:
        try:
            async with Worker(scheduler, nthreads=workers, name=None) as worker:
                await worker.finished()
        except (OSError, TimeoutError) as error:
            logger.warning("no_scheduler", reason=str(error))
        await asyncio.sleep(1.0)
