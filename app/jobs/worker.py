"""The worker process: warm up, then answer one call after the other until the service ends."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import resource
import signal
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from multiprocessing.connection import Connection
from typing import Any

from app.designs.progress import Progress, Report

Entry = Callable[[str, str, bytes, Report], Any]
"""``(kind slug, mode, request as JSON, report) -> Answer``; a module-level function, so that it can be sent by name."""

_BETWEEN_REPORTS_S = 0.2


@dataclass(frozen=True)
class WorkerSettings:
    """What a worker runs, and its limits. ``memory_bytes`` is counted from what the warm worker occupies."""

    entry: Entry
    warm_up: Callable[[], None]
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
    _die_with_the_service()
    # Ctrl-C in a terminal goes to the whole process group; the service decides when its workers end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The service's own process answers health checks and inline requests first.
    os.nice(settings.niceness)
    settings.warm_up()
    _bound_memory(settings.memory_bytes)
    connection.send((Reply.READY, None))
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            call = connection.recv()
            # From here on, a death of this process is the call's.
            connection.send((Reply.ACCEPTED, None))
            reply, content = _answer(settings.entry, call, _seldom(connection))
            connection.send((reply, content))
            if reply is Reply.MEMORY:
                return


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


def _die_with_the_service() -> None:
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(0)

    threading.Thread(target=watch, name="parent-watch", daemon=True).start()


def _bound_memory(allowance: int) -> None:
    """Bound the address space to what is mapped now and the allowance on top of it."""
    try:
        with open("/proc/self/statm") as statistics:
            mapped = int(statistics.read().split()[0]) * resource.getpagesize()
    except OSError:  # no /proc on this system: bound the whole instead
        mapped = 0
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    wanted = mapped + allowance
    # Some systems know the limit but refuse to set it; the time budget still holds there.
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))
