"""Kernel warm-up: compile the kernels of every part ahead of the first request, in child processes, with progress.

A part is a kind and a mode, or the first run (`app.designs.rehearsals.PARTS`). The entry points it is known to call are
compiled first (`app.designs.entries`), in units shared between two processes. Then its rehearsals are solved: they load
those kernels from disk, compile any that were not listed, and write the part's marker.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass

from app.jobs.calls import EXPORT, PICTURE
from app.jobs.compiling import Unit, compile_units, report_compiled, solve_rehearsals
from app.jobs.errors import Warming, WorkerCrashed
from app.jobs.fork_server import Child, ForkServer
from app.jobs.warm_markers import Part
from app.logging import get_logger

logger = get_logger(__name__)

PROCESSES = 2
_ATTEMPTS = 3
_POLL_INTERVAL_S = 0.25
_PRIOR_PACE, _PRIOR_SIZE = 1.2e-4, 10_000
"""Prior estimate of the seconds per byte of a kernel's bytecode, and its weight in bytes: 1 % of all, as machines
differ by more than a factor of three."""
_READING = 1.5
"""Time to read a kernel's bytecode relative to that of making machine code of it."""


@dataclass(frozen=True)
class WarmupStatus:
    """Progress of a kind.

    ``state`` is ``unknown``, ``waiting``, ``compiling``, ``warm`` or ``failed``; ``compiled`` of ``of`` kernels are
    compiled, and about ``remaining_s`` seconds remain.
    """

    kind: str
    state: str
    compiled: int
    of: int
    remaining_s: float


@dataclass
class _Progress:
    """State of a part, and how often its rehearsals were tried."""

    state: str = "unknown"
    attempts: int = 0


@dataclass(frozen=True)
class _Task:
    """Work for a compiler process: a unit of entries to compile, or without one the part's rehearsals."""

    part: Part
    unit: Unit | None = None


StatusListener = Callable[[WarmupStatus], None]


def ignore_status(_status: WarmupStatus) -> None:
    """No-op listener."""


class KernelWarming:
    """Compiles the kernels of every part to disk; ``on_status`` is called from other threads at every change."""

    def __init__(
        self, fork_server: ForkServer, on_status: StatusListener = ignore_status, processes: int = PROCESSES
    ) -> None:
        self._fork_server, self._on_status, self._processes = fork_server, on_status, processes
        self._parts: dict[Part, _Progress] = {}
        self._sizes: dict[str, dict[str, int]] = {}
        """Size of the code of every kernel of a kind."""
        self._compiled: set[str] = set()
        self._finished: list[frozenset[str]] = []
        """Kernels of every unit that is finished."""
        self._waiting: deque[_Task] = deque()
        self._running: list[_Task] = []
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self._closed = False
        self._done = threading.Event()
        self._began = time.monotonic()

    def start(self) -> None:
        """Start in the background."""
        threading.Thread(target=self._run, name="kernels", daemon=True).start()

    def close(self) -> None:
        """Start no further compilation. Closing the fork server kills what is running."""
        self._closed = True

    def wait(self, timeout: float | None = None) -> bool:
        """Block until everything is compiled or has failed; False on timeout."""
        return self._done.wait(timeout)

    @property
    def known(self) -> bool:
        """Whether the kernel cache has been inspected."""
        return bool(self._parts) or self._done.is_set()

    @property
    def failed(self) -> list[Part]:
        return [part for part, progress in self._parts.items() if progress.state == "failed"]

    def is_warm(self, kind: str, mode: str) -> bool:
        """Whether requests of this kind and mode need no compiler. An accuracy study needs all kernels of its kind; a
        picture or export only those that its run has called, so any compiled part of the kind will do.

        A part that could not be compiled ahead counts as warm: its requests compile on demand.
        """
        if self._done.is_set():
            return True
        with self._lock:
            concerned = [p for part, p in self._parts.items() if part == (kind, mode)] or [
                p for part, p in self._parts.items() if part[0] == kind
            ]
            ready = [p.state in ("warm", "failed") for p in concerned]
            return any(ready) if mode.startswith((PICTURE, EXPORT)) else bool(ready) and all(ready)

    def check(self, kind: str, mode: str) -> None:
        """Raise Warming with the remaining time if the kernels of this kind and mode are not compiled yet."""
        if not self.is_warm(kind, mode):
            raise Warming(kind, self.status(kind).remaining_s)

    def statuses(self) -> list[WarmupStatus]:
        """Status of every kind, in compilation order."""
        with self._lock:
            kinds = list(dict.fromkeys(kind for kind, _ in self._parts))
        return [self.status(kind) for kind in kinds]

    def status(self, kind: str) -> WarmupStatus:
        """Status of one kind."""
        with self._lock:
            states = [p.state for part, p in self._parts.items() if part[0] == kind]
            kernels = self._sizes.get(kind, {}).keys()
            done, of = len(kernels & self._compiled), len(kernels)
            if not states or "unknown" in states:
                return WarmupStatus(kind, "unknown", 0, 0, 1.0)
            if all(state == "warm" for state in states):
                return WarmupStatus(kind, "warm", of, of, 0.0)
            if set(states) <= {"warm", "failed"}:
                return WarmupStatus(kind, "failed", done, of, 0.0)
            state = "compiling" if {"compiling", "warm"} & set(states) else "waiting"
            return WarmupStatus(kind, state, done, of, self._remaining(kind))

    def _remaining(self, kind: str) -> float:
        """Estimated seconds until the kind is warm, at the pace so far; kinds before it in the queue are compiled
        first.

        The code of every kernel counts when it has been read, and when a unit that includes it is machine code. Kernels
        in no unit are not called by rehearsals, and are mostly never compiled.
        """
        kinds = list(self._sizes)
        open_ = {part[0] for part, p in self._parts.items() if p.state in ("waiting", "compiling")}
        ahead = {each for each in kinds[: kinds.index(kind) + 1] if each in open_}
        size_of = {name: size for sizes in self._sizes.values() for name, size in sizes.items()}
        tasks = (*self._waiting, *self._running)
        units = [task.unit.kernels for task in tasks if task.unit and task.part[0] in ahead]
        unread = frozenset().union(*units) - self._compiled
        left = _READING * _size(unread, size_of) + sum(_size(kernels, size_of) for kernels in units)
        done = _READING * _size(self._compiled, size_of) + sum(_size(kernels, size_of) for kernels in self._finished)
        elapsed = time.monotonic() - self._began
        return max(1.0, left * (elapsed + _PRIOR_PACE * _PRIOR_SIZE) / (done + _PRIOR_SIZE))

    def _run(self) -> None:
        try:
            self._inspect_cache()
            if self._waiting:
                with suppress(WorkerCrashed):  # it is restarted, and its children import the compiler themselves
                    self._fork_server.prepare_to_compile()
            threads = [
                threading.Thread(target=self._work, name="kernels", daemon=True)
                for _ in range(min(self._processes, len(self._waiting)))
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        finally:
            self._done.set()

    def _inspect_cache(self) -> None:
        """Find out which parts are compiled, with retries, because the fork server may be restarted meanwhile."""
        for _ in range(_ATTEMPTS):
            try:
                child = self._fork_server.fork(report_compiled)
                try:
                    compiled, kernels, units = child.connection.recv()
                finally:
                    child.kill()
                    self._fork_server.exit_code(child)
                break
            except (WorkerCrashed, EOFError, OSError):
                if self._closed:
                    return
                time.sleep(1.0)
        else:
            logger.error("kernel_cache_unreadable")
            return
        with self._lock:
            self._began = time.monotonic()
            self._parts = {part: _Progress("warm" if warm else "waiting") for part, warm in compiled.items()}
            self._sizes = kernels
            for part in (part for part, warm in compiled.items() if not warm):
                self._waiting.extend(_Task(part, unit) for unit in units[part])
                self._waiting.append(_Task(part))
        for kind in dict.fromkeys(task.part[0] for task in self._waiting):
            self._on_status(self.status(kind))

    def _work(self) -> None:
        """Work through the tasks with one compiler process until none is left."""
        compiler = _Compiler(self._fork_server, self._kernels_compiled)
        try:
            while (task := self._next_task(compiler.kernels)) is not None:
                try:
                    if task.unit:
                        compiler.compile(task)
                    else:
                        self._rehearse(task)
                finally:
                    with self._changed:
                        self._running.remove(task)
                        if task.unit:
                            self._finished.append(task.unit.kernels)
                        self._changed.notify_all()
        finally:
            compiler.close()

    def _next_task(self, own: set[str]) -> _Task | None:
        """The first runnable task: rehearsals wait until the entries of earlier parts and their own are compiled.

        Of the units of a part, the one most of whose kernels are among the process's ``own``, which it has compiled,
        and fewest among those of others: inner kernels are then compiled once.
        """
        with self._changed:
            while self._waiting and not self._closed:
                order = list(self._parts)
                busy = min((order.index(task.part) for task in self._running if task.unit), default=len(order))
                found = next((s for s in self._waiting if s.unit or order.index(s.part) < busy), None)
                if found is not None:
                    others = self._compiled - own
                    units = [task for task in self._waiting if task.unit and task.part == found.part]
                    found = max(units, key=lambda task: _shared(task.unit, own, others)) if found.unit else found
                    self._waiting.remove(found)
                    self._running.append(found)
                    self._parts[found.part].state = "compiling"
                    return found
                self._changed.wait(_POLL_INTERVAL_S)
        return None

    def _kernels_compiled(self, part: Part, names: list[str]) -> None:
        with self._lock:
            self._compiled.update(names)
        self._on_status(self.status(part[0]))

    def _rehearse(self, task: _Task) -> None:
        part, progress = task.part, self._parts[task.part]
        progress.attempts += 1
        state = "warm" if self._solve(part) else "failed"
        with self._lock:
            if state == "failed" and progress.attempts < _ATTEMPTS and not self._closed:
                state = "waiting"
                self._waiting.append(task)
            progress.state = state
        if state == "waiting":
            time.sleep(1.0)
        elif not self._closed:
            now = self.status(part[0])
            (logger.error if state == "failed" else logger.info)(
                "kernel_warmup", kind=part[0], mode=part[1], state=state
            )
            self._on_status(now)

    def _solve(self, part: Part) -> bool:
        try:
            child = self._fork_server.fork(solve_rehearsals, part)
        except WorkerCrashed:
            return False
        try:
            while (names := child.connection.recv()) is not None:
                self._kernels_compiled(part, names)
            return True
        except (EOFError, OSError):
            return False
        finally:
            child.kill()
            self._fork_server.exit_code(child)


def _size(names: Iterable[str], size_of: Mapping[str, int]) -> int:
    return sum(size_of.get(name, 0) for name in names)


def _shared(unit: Unit, own: set[str], others: set[str]) -> float:
    """Share of the unit's kernels that are among ``own``, less that among ``others``."""
    return (len(unit.kernels & own) - len(unit.kernels & others)) / len(unit.kernels)


class _Compiler:
    """A child process that compiles units one after another; inner kernels that they share are typed once.

    ``kernels`` are those it has compiled.
    """

    def __init__(self, fork_server: ForkServer, on_compiled: Callable[[Part, list[str]], None]) -> None:
        self._fork_server, self._on_compiled = fork_server, on_compiled
        self._child: Child | None = None
        self.kernels: set[str] = set()

    def compile(self, task: _Task) -> None:
        """Compile a unit; what fails is left to the rehearsals."""
        try:
            if self._child is None:
                self._child = self._fork_server.fork(compile_units)
            self._child.connection.send(task.unit)
            while (names := self._child.connection.recv()) is not None:
                self.kernels.update(names)
                self._on_compiled(task.part, names)
        except (WorkerCrashed, EOFError, OSError):
            self.close()

    def close(self) -> None:
        """Kill the process."""
        if self._child is not None:
            self._child.kill()
            self._fork_server.exit_code(self._child)
            self._child = None
            self.kernels.clear()


def format_status(status: WarmupStatus) -> str:
    """Format the progress of a kind's kernels as one line of text."""
    texts = {
        "unknown": "checking for compiled kernels",
        "waiting": f"{status.of} kernels to compile, about {status.remaining_s:.0f} s",
        "compiling": f"{status.compiled} of {status.of} kernels compiled, about {status.remaining_s:.0f} s left",
        "warm": "ready",
        "failed": "its kernels could not be compiled ahead; each is compiled on first use",
    }
    return texts[status.state]
