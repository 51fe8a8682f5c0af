"""One place in the pool: a worker process that is started, used, killed and replaced."""

from __future__ import annotations

import threading
import time
from typing import Any

from app.designs.progress import Report, to_nobody
from app.jobs.errors import BudgetExceeded, Busy, ExecutorClosed, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.template import START_TIMEOUT_S, Child, Template
from app.jobs.worker import Reply, WorkerSettings, serve
from app.logging import get_logger

logger = get_logger(__name__)

LOAD_TIMEOUT_S = 120.0
_STARVED_RETRY_S = 5.0
"""How long a worker may load, or where it must, compile what a call needs, before the call's own time counts."""


class Call:
    """One solve: what to run, and the handle by which it can be cancelled while it runs."""

    def __init__(self, kind_slug: str, mode: str, payload: bytes, budget_s: float, report: Report = to_nobody) -> None:
        self.message = (kind_slug, mode, payload)
        self.budget_s = budget_s
        self.report = report
        self.cancelled = False
        self._lock = threading.Lock()
        self._place: Place | None = None

    def begin(self, place: Place) -> bool:
        """False if the call was cancelled before its turn came."""
        with self._lock:
            if not self.cancelled:
                self._place = place
            return not self.cancelled

    def end(self) -> None:
        with self._lock:
            self._place = None

    def cancel(self) -> None:
        """Forget the call; if it is being solved, kill its worker. The lock keeps the next call's worker safe."""
        with self._lock:
            self.cancelled = True
            if self._place is not None:
                self._place.kill()


class Place:
    """A slot of the pool. At most one thread uses it at a time; ``kill`` may come from any thread."""

    def __init__(self, settings: WorkerSettings, template: Template) -> None:
        self._settings = settings
        self._template = template
        self._child: Child | None = None
        self._ready = False
        self._closed = False
        self._guard = threading.Lock()

    @property
    def pid(self) -> int | None:
        child = self._child
        return child.pid if child is not None else None

    @property
    def ready(self) -> bool:
        """Whether a worker waits or works here, by the look of it now."""
        with self._guard:
            return self._ready and self._child is not None and self._child.alive

    def prepare(self) -> None:
        """Have a live worker here, starting one if needed."""
        if self._child is None or not self._child.alive:
            if self._child is not None and not self._closed:
                logger.warning("worker_lost", pid=self._child.pid)
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
        """Run the call on this place's worker within the call's budget."""
        deadline = self._hand_over(call) or self._hand_over(call)
        if deadline is None:
            raise WorkerCrashed(None)
        try:
            reply, content = self._next(call, deadline)
            while reply is Reply.PROGRESS:
                call.report(content)
                reply, content = self._next(call, deadline)
        except (EOFError, OSError) as error:
            raise WorkerCrashed(self._discard()) from error
        if reply is Reply.ANSWER:
            return content
        if reply is Reply.MEMORY:
            self._discard()
            raise MemoryExceeded("the solve wanted more memory than a worker may have")
        raise SolveFailed(*content)

    def _next(self, call: Call, deadline: float) -> tuple[Reply, Any]:
        """The worker's next message; it is killed if none comes in time."""
        assert self._child is not None
        if not self._child.connection.poll(max(0.0, deadline - time.monotonic())):
            self._discard()
            raise BudgetExceeded(call.budget_s)
        return self._child.connection.recv()

    def _hand_over(self, call: Call) -> float | None:
        """Give the call to the worker; when it must have ended. None if the worker had died while idle."""
        self.prepare()
        assert self._child is not None
        try:
            self._child.connection.send(call.message)
            if not self._child.connection.poll(LOAD_TIMEOUT_S):
                self._discard()
                raise WorkerCrashed(None)
            self._child.connection.recv()
        except (EOFError, OSError) as error:
            code = self._discard()
            if call.cancelled or self._closed:
                raise WorkerCrashed(code) from error
            return None
        return time.monotonic() + call.budget_s

    def kill(self) -> None:
        with self._guard:
            if self._child is not None:
                self._child.kill()

    def close(self) -> None:
        """Kill the worker and start no other."""
        self._closed = True
        self.kill()

    def _start(self) -> None:
        try:
            child = self._template.fork(serve, self._settings)
        except OSError as error:  # no descriptor to spare, no process, no memory
            raise Busy(f"no worker can be started: {error.strerror}", _STARVED_RETRY_S) from error
        with self._guard:
            self._child, self._ready = child, False
        if self._closed:
            self.kill()
            raise ExecutorClosed("the executor is closing")

    def _discard(self) -> int | None:
        """Kill and forget the worker; its exit code, if it had one."""
        self.kill()
        with self._guard:
            child, self._child, self._ready = self._child, None, False
        return None if child is None else self._template.exit_code(child)
