"""A lane: the workers of one priority, and the calls that wait for one of them."""

from __future__ import annotations

import asyncio
import math
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future

from app.jobs.errors import ExecutorClosed, JobError, WorkerCrashed
from app.jobs.fork_server import START_TIMEOUT_S
from app.jobs.worker import WorkerSettings
from app.jobs.worker_process import Worker
from app.logging import get_logger

logger = get_logger(__name__)


class Lane:
    """Lends ``wanted`` workers to calls; lanes never wait for each other.

    Calls take and return workers on an event loop, the pool's supervisor starts and reaps them in its thread;
    ``on_lost`` wakes it.
    """

    def __init__(
        self, settings: WorkerSettings, wanted: int, on_lost: Callable[[], None], limit: float = math.inf
    ) -> None:
        self.settings, self.wanted, self._on_lost = settings, wanted, on_lost
        self.pending, self.limit = 0, limit
        """Number of running and waiting calls, now and at most."""
        self._workers: list[Worker] = []
        self._idle: list[Worker] = []
        self._lost: list[Worker] = []
        self._waiting: deque[Future[Worker]] = deque()
        self._lock = threading.Lock()
        self._closed = False

    @property
    def ready(self) -> bool:
        """Whether a worker is alive."""
        return any(worker.alive for worker in self.workers)

    @property
    def workers(self) -> list[Worker]:
        with self._lock:
            return list(self._workers)

    async def acquire(self) -> Worker:
        """Borrow a worker; of the idle ones the most recently used, whose memory is still in the caches.

        Raises ExecutorClosed, WorkerCrashed if no worker becomes available, and the error with which the supervisor
        failed to start one.
        """
        with self._lock:
            if self._closed:
                raise ExecutorClosed("the executor is closing")
            while self._idle:
                worker = self._idle[-1]
                if worker.alive:
                    return self._idle.pop()
                self._drop(worker)
            waiting: Future[Worker] = Future()
            self._waiting.append(waiting)
        try:
            return await asyncio.wait_for(asyncio.wrap_future(waiting), START_TIMEOUT_S)
        except (TimeoutError, asyncio.CancelledError) as ended:
            with self._lock:
                lent = not waiting.cancel() and waiting.exception() is None
            if lent:
                self.release(waiting.result())
            if isinstance(ended, TimeoutError):
                raise WorkerCrashed(None) from None
            raise

    def release(self, worker: Worker) -> None:
        """Return a worker; one that is outdated or no longer usable is killed and replaced."""
        with self._lock:
            kept = worker.usable and not worker.outdated
            if not kept:
                worker.kill()
            if kept and not self._closed:
                self._lend(worker)
            else:
                self._lose(worker)

    def missing(self) -> int:
        """Number of workers to start."""
        with self._lock:
            for worker in [each for each in self._idle if not self._closed and not each.alive]:
                self._drop(worker)
            return 0 if self._closed else self.wanted - len(self._workers)

    def add(self, worker: Worker) -> None:
        """Take in a worker just started."""
        with self._lock:
            self._workers.append(worker)
            if self._closed:
                self._lose(worker)
            else:
                self._lend(worker)

    def take_lost(self) -> list[Worker]:
        """Workers to be reaped."""
        with self._lock:
            lost, self._lost = self._lost, []
        return lost

    def refuse(self, error: JobError) -> None:
        """Raise an error in the calls that wait, because no worker can be started."""
        with self._lock:
            for waiting in self._waiting:
                if waiting.set_running_or_notify_cancel():
                    waiting.set_exception(error)
            self._waiting.clear()

    def renew(self) -> None:
        """Replace every worker by one forked anew: the idle ones now, the others after their calls."""
        with self._lock:
            for worker in self._workers:
                worker.outdated = True
            for worker in list(self._idle):
                worker.kill()
                self._lose(worker)

    def close(self) -> None:
        """Kill every worker, and refuse the calls that wait and those to come."""
        with self._lock:
            self._closed = True
            for worker in self._workers:
                worker.kill()
            while self._idle:
                self._lose(self._idle[-1])
        self.refuse(ExecutorClosed("the executor closed before the solve began"))

    def _lend(self, worker: Worker) -> None:
        """Give a worker to the call that has waited longest, if any; like the next two methods, called with the lock
        held."""
        while self._waiting:
            waiting = self._waiting.popleft()
            if waiting.set_running_or_notify_cancel():
                waiting.set_result(worker)
                return
        self._idle.append(worker)

    def _drop(self, worker: Worker) -> None:
        logger.warning("worker_exited", pid=worker.pid)
        self._lose(worker)

    def _lose(self, worker: Worker) -> None:
        if worker in self._idle:
            self._idle.remove(worker)
        self._workers.remove(worker)
        self._lost.append(worker)
        self._on_lost()
