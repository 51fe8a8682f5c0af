"""The worker process: answer calls one after the other until the service ends."""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import resource
import struct
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from multiprocessing.connection import Connection
from typing import Any

from app.designs.progress import Progress, Report

Entry = Callable[[str, str, bytes, Report], Any]
"""``(kind slug, mode, request as JSON, report) -> Answer``; a module-level function, so that it can be pickled."""

Load = Callable[[str, str], None]
"""``(kind slug, mode)``: load what its calls need into memory."""

_REPORT_INTERVAL_S = 0.2
_READ_BYTES = 1 << 16
LENGTH = struct.Struct("!i")
"""The length that ``multiprocessing`` puts before a message."""


@dataclass(frozen=True)
class WorkerSettings:
    """What a worker runs, and its limits.

    ``memory_bytes`` is the allowance for calls on top of what the worker occupies by itself.
    """

    entry: Entry
    load: Load
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
    """Main function of a worker. Returns when the service closes the connection or dies."""
    # Health checks and inline requests in the service process take precedence.
    os.nice(settings.niceness)
    memory, pipe = _MemoryLimit(settings.memory_bytes), connection.fileno()
    _send(pipe, (Reply.READY, None))
    loaded: set[tuple[str, str]] = set()
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            call = _receive(pipe)
            if call[:2] not in loaded:
                with memory.unlimited():
                    settings.load(call[0], call[1])
                loaded.add(call[:2])
                gc.freeze()  # kernels are permanent; later collections need not scan them
                # From here on the call's budget runs. A worker that has already loaded what the call needs starts it at
                # once.
                _send(pipe, (Reply.ACCEPTED, None))
            reply, content = _answer(settings.entry, call, _throttled(pipe))
            _send(pipe, (reply, content))
            if reply is Reply.MEMORY:
                return


def _receive(pipe: int) -> tuple[str, str, bytes]:
    """Wait for the next call; ``multiprocessing`` reads a message in two system calls and a dozen steps. Raises
    EOFError when the service has closed the connection."""
    received = bytearray()
    while len(received) < LENGTH.size or len(received) < LENGTH.size + LENGTH.unpack_from(received)[0]:
        part = os.read(pipe, _READ_BYTES)
        if not part:
            raise EOFError
        received += part
    return pickle.loads(memoryview(received)[LENGTH.size :])


def _send(pipe: int, message: tuple[Reply, Any]) -> None:
    """Send a message as ``multiprocessing`` does, but in one piece: it writes the length of a large one separately,
    which wakes the reader twice."""
    reply, content = message
    data = memoryview(pickle.dumps((str(reply), content), pickle.HIGHEST_PROTOCOL))
    sent = os.writev(pipe, (LENGTH.pack(len(data)), data)) - LENGTH.size
    while sent < len(data):
        sent += os.write(pipe, data[sent:])


def _answer(entry: Entry, call: tuple[str, str, bytes], report: Report) -> tuple[Reply, Any]:
    try:
        return Reply.ANSWER, entry(*call, report)
    except MemoryError:
        return Reply.MEMORY, None
    except Exception as error:
        return Reply.ERROR, (type(error).__name__, traceback.format_exc())


def _throttled(pipe: int) -> Report:
    """A report function limited to a few messages a second, so that sending never slows the solve down."""
    due = 0.0

    def report(progress: Progress) -> None:
        nonlocal due
        if time.monotonic() >= due:
            _send(pipe, (Reply.PROGRESS, progress))
            due = time.monotonic() + _REPORT_INTERVAL_S

    return report


class _MemoryLimit:
    """Limits the address space to what the worker occupies by itself plus an allowance for its calls."""

    def __init__(self, allowance: int) -> None:
        self._allowance = allowance
        self._own = _mapped()
        _limit_memory(self._own + allowance)

    @contextlib.contextmanager
    def unlimited(self) -> Iterator[None]:
        """Lift the limit for the block; what is allocated in it counts as the worker's own."""
        _limit_memory(resource.RLIM_INFINITY)
        before = _mapped()
        yield
        self._own += _mapped() - before
        _limit_memory(self._own + self._allowance)


def _mapped() -> int:
    try:
        with open("/proc/self/statm") as statistics:
            return int(statistics.read().split()[0]) * resource.getpagesize()
    except OSError:  # no /proc: the limit then applies to the total
        return 0


def _limit_memory(wanted: int) -> None:
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard != resource.RLIM_INFINITY:
        wanted = hard if wanted == resource.RLIM_INFINITY else min(wanted, hard)
    # Some systems define the limit but refuse to set it; the time budget still applies.
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))
