"""A slot of the process pool: starts, uses, kills and replaces one worker process."""

from __future__ import annotations

import threading
import time
from typing import Any

from app.designs.progress import Report, ignore_progress
from app.jobs.errors import BudgetExceeded, Busy, ExecutorClosed, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.fork_server import START_TIMEOUT_S, Child, ForkServer
from app.jobs.worker import Reply, WorkerSettings, serve
from app.logging import get_logger

logger = get_logger(__name__)

LOAD_TIMEOUT_S = 120.0
"""Time limit for loading or compiling what a call needs; not counted in the call's own budget."""
_RESOURCES_RETRY_S = 5.0


class Call:
    """A solve: what to run, and a handle to cancel it."""

    def __init__(
        self, kind_slug: str, mode: str, payload: bytes, budget_s: float, report: Report = ignore_progress
    ) -> None:
        self.message = (kind_slug, mode, payload)
        self.budget_s = budget_s
        self.report = report
        self.cancelled = False
        self._lock = threading.Lock()
        self._slot: WorkerSlot | None = None

    def begin(self, slot: WorkerSlot) -> bool:
        """Bind the call to a slot; False if it was cancelled before."""
        with self._lock:
            if not self.cancelled:
                self._slot = slot
            return not self.cancelled

    def end(self) -> None:
        with self._lock:
            self._slot = None

    def cancel(self) -> None:
        """Cancel the call and kill its worker if it is running. The lock protects the worker of a later call."""
        with self._lock:
            self.cancelled = True
            if self._slot is not None:
                self._slot.kill()


class WorkerSlot:
    """A slot of the pool. Only one thread at a time may use it, but ``kill`` is thread-safe."""

    def __init__(self, settings: WorkerSettings, fork_server: ForkServer) -> None:
        self._settings = settings
        self._fork_server = fork_server
        self._child: Child | None = None
        self._loaded: set[tuple[str, str]] = set()
        self._ready = False
        self._closed = False
        self._lock = threading.Lock()

    @property
    def pid(self) -> int | None:
        child = self._child
        return child.pid if child is not None else None

    @property
    def ready(self) -> bool:
        """Whether the slot has a live worker that has started up."""
        with self._lock:
            return self._ready and self._child is not None and self._child.alive

    def prepare(self) -> None:
        """Ensure that a live worker is ready, starting one if needed. Raises WorkerCrashed."""
        if self._child is None or not self._child.alive:
            if self._child is not None and not self._closed:
                logger.warning("worker_exited", pid=self._child.pid)
            self._discard()
            self._start()
        if self._ready:
            return
        try:
            if not self._child.connection.poll(START_TIMEOUT_S):
                raise WorkerCrashed(None)
            self._child.connection.recv()
        except (EOFError, OSError) as error:
            raise WorkerCrashed(self._discard()) from error
        self._ready = True

    def solve(self, call: Call) -> Any:
        """Run the call on this slot's worker and return its answer.

        Raises BudgetExceeded, MemoryExceeded, WorkerCrashed or SolveFailed.
        """
        outcome = self._attempt(call) or self._attempt(call)
        if outcome is None:
            raise WorkerCrashed(None)
        reply, content = outcome
        if reply is Reply.ANSWER:
            return content
        if reply is Reply.MEMORY:
            self._discard()
            raise MemoryExceeded("the solve exceeded the memory limit of a worker")
        raise SolveFailed(*content)

    def _attempt(self, call: Call) -> tuple[Reply, Any] | None:
        """Return a worker's reply to the call; None if the worker may have died before it began the call."""
        accepted = False
        try:
            accepted = self._send(call)
            deadline = time.monotonic() + call.budget_s
            reply, content = self._receive(call, deadline)
            while reply is Reply.PROGRESS:
                accepted = True
                call.report(content)
                reply, content = self._receive(call, deadline)
        except (EOFError, OSError) as error:
            code = self._discard()
            if accepted or call.cancelled or self._closed:
                raise WorkerCrashed(code) from error
            return None
        return reply, content

    def _receive(self, call: Call, deadline: float) -> tuple[Reply, Any]:
        """Return the worker's next message; kill it and raise BudgetExceeded at the deadline."""
        assert self._child is not None
        if not self._child.connection.poll(max(0.0, deadline - time.monotonic())):
            self._discard()
            raise BudgetExceeded(call.budget_s)
        return self._child.connection.recv()

    def _send(self, call: Call) -> bool:
        """Send the call; wait until the worker has loaded what such calls need, if it has not yet. Return whether it
        then accepted the call."""
        self.prepare()
        assert self._child is not None
        kind = call.message[:2]
        self._child.connection.send(call.message)
        if kind in self._loaded:
            return False
        if not self._child.connection.poll(LOAD_TIMEOUT_S):
            self._discard()
            raise WorkerCrashed(None)
        self._child.connection.recv()
        self._loaded.add(kind)
        return True

    def kill(self) -> None:
        with self._lock:
            if self._child is not None:
                self._child.kill()

    def close(self) -> None:
        """Kill the worker and start no further one."""
        self._closed = True
        self.kill()

    def _start(self) -> None:
        try:
            child = self._fork_server.fork(serve, self._settings)
        except OSError as error:  # out of file descriptors, processes or memory
            raise Busy(f"no worker process can be started: {error.strerror}", _RESOURCES_RETRY_S) from error
        with self._lock:
            self._child, self._ready, self._loaded = child, False, set()
        if self._closed:
            self.kill()
            raise ExecutorClosed("the executor is closing")

    def _discard(self) -> int | None:
        """Kill and drop the worker; return its exit code, if known."""
        self.kill()
        with self._lock:
            child, self._child, self._ready = self._child, None, False
        return None if child is None else self._fork_server.exit_code(child)
