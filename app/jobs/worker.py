"""The worker process: answer one call after the other until the service ends; between them, load kernels."""

from __future__ import annotations

import contextlib
import os
import resource
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from multiprocessing.connection import Connection
from typing import Any

from app.designs.progress import Progress, Report

Entry = Callable[[str, str, bytes, Report], Any]
"""``(kind slug, mode, request as JSON, report) -> Answer``; a module-level function, so that it can be sent by name."""

Load = Callable[[str, str], None]
"""``(kind slug, mode)``: have in memory what its calls need."""

_BETWEEN_REPORTS_S = 0.2
_QUIET_S = 0.5
"""So long nobody must have asked for anything before a worker does something of its own."""


@dataclass(frozen=True)
class WorkerSettings:
    """What a worker runs, and its limits. ``memory_bytes`` is counted from what it occupies before its calls.

    ``idle_work`` gives what to do step by step while nobody asks for anything.
    """

    entry: Entry
    load: Load
    idle_work: Callable[[], Iterator[None]]
    memory_bytes: int
    niceness: int


class Reply(StrEnum):
    READY = "ready"
    ACCEPTED = "accepted"
    PROGRESS = "progress"
    ANSWER = "answer"
    MEMORY = "memory"
    ERROR = "error"


def serve(connection: Connection, settings: WorkerSettings) -> None:
    """The worker's main function. Ends when the service closes the connection or dies."""
    # The service's own process answers health checks and inline requests first.
    os.nice(settings.niceness)
    memory = _Memory(settings.memory_bytes)
    connection.send((Reply.READY, None))
    idle_work: Iterator[None] | None = settings.idle_work()
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            while idle_work is not None and not connection.poll(_QUIET_S):
                with memory.unbound():
                    idle_work = _one_step(idle_work)
            call = connection.recv()
            with memory.unbound():
                settings.load(call[0], call[1])
            # From here on, a death of this process is the call's.
            connection.send((Reply.ACCEPTED, None))
            reply, content = _answer(settings.entry, call, _seldom(connection))
            connection.send((reply, content))
            if reply is Reply.MEMORY:
                return


def _one_step(steps: Iterator[None]) -> Iterator[None] | None:
    """The same steps after the next one was taken; None when there is no more, or one went wrong.

    What goes wrong here goes wrong again in a call, which reports it.
    """
    with contextlib.suppress(Exception):
        next(steps)
        return steps
    return None


def _answer(entry: Entry, call: tuple[str, str, bytes], report: Report) -> tuple[Reply, Any]:
    try:
        return Reply.ANSWER, entry(*call, report)
    except MemoryError:
        return Reply.MEMORY, None
    except Exception as error:
        return Reply.ERROR, (type(error).__name__, traceback.format_exc())


def _seldom(connection: Connection) -> Report:
    """Progress on its way to the service: some messages a second, however fast the solve, so that none waits long."""
    due = 0.0

    def report(progress: Progress) -> None:
        nonlocal due
        if time.monotonic() >= due:
            connection.send((Reply.PROGRESS, progress))
            due = time.monotonic() + _BETWEEN_REPORTS_S

    return report


class _Memory:
    """Bounds the address space to what the worker occupies by itself and an allowance for its calls on top of it."""

    def __init__(self, allowance: int) -> None:
        self._allowance = allowance
        self._own = _mapped()
        _limit_memory(self._own + allowance)

    @contextlib.contextmanager
    def unbound(self) -> Iterator[None]:
        """Without bound meanwhile; what is taken up here is the worker's own."""
        _limit_memory(resource.RLIM_INFINITY)
        before = _mapped()
        yield
        self._own += _mapped() - before
        _limit_memory(self._own + self._allowance)


def _mapped() -> int:
    try:
        with open("/proc/self/statm") as statistics:
            return int(statistics.read().split()[0]) * resource.getpagesize()
    except OSError:  # no /proc on this system: the bound holds for the whole instead
        return 0


def _limit_memory(wanted: int) -> None:
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard != resource.RLIM_INFINITY:
        wanted = hard if wanted == resource.RLIM_INFINITY else min(wanted, hard)
    # Some systems know the limit but refuse to set it; the time budget still holds there.
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))
