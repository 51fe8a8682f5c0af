"""Kernels are compiled before they are asked for: part by part, in processes of their own, told how far it is.

A part is a kind and a mode (`app.designs.rehearsals.PARTS`). First the kernels that it is known to call are compiled by
themselves (`app.designs.entries`), in bundles that two processes share out; then its rehearsals are solved, which finds
these on disk, compiles what was not known, and leaves the mark.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

from app.jobs.compiling import Unit, compile_units, solve_rehearsals, tell_what_is_there
from app.jobs.errors import Warming, WorkerCrashed
from app.jobs.marks import Part
from app.jobs.template import Child, Template
from app.logging import get_logger

logger = get_logger(__name__)

PROCESSES = 2
_ATTEMPTS = 3
_BETWEEN_REPORTS_S = 0.25
_USUAL_S, _WEIGHT = 0.25, 10
"""Seconds that a kernel takes as long as nothing was measured, and how many kernels outweigh that guess."""


@dataclass(frozen=True)
class Warmth:
    """How far a kind is: its state (``unknown``, ``waiting``, ``compiling``, ``warm``, ``failed``), kernels compiled,
    how many there are, and about how many seconds are left."""

    kind: str
    state: str
    compiled: int
    of: int
    remaining_s: float


@dataclass
class _Progress:
    """One part on its way."""

    state: str = "unknown"
    attempts: int = 0


@dataclass(frozen=True)
class _Step:
    """A bundle of entries to compile, or without one, a part's rehearsals."""

    part: Part
    unit: Unit = ()


@dataclass
class _Wing:
    """The kernels of one kind: all there are, and those that are there."""

    kernels: frozenset[str] = frozenset()
    compiled: set[str] = field(default_factory=set)


Told = Callable[[Warmth], None]


def tell_nobody(_warmth: Warmth) -> None:
    """Tell nobody."""


class KernelWarming:
    """Sees to it that the kernels of every part are on disk; ``told`` hears of every step, from other threads."""

    def __init__(self, template: Template, told: Told = tell_nobody, processes: int = PROCESSES) -> None:
        self._template, self._told, self._processes = template, told, processes
        self._parts: dict[Part, _Progress] = {}
        self._wings: dict[str, _Wing] = {}
        self._waiting: deque[_Step] = deque()
        self._running: list[_Step] = []
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)
        self._children: list[Child] = []
        self._closed = False
        self._done = threading.Event()
        self._began = time.monotonic()
        self._compiled_before = 0

    def start(self) -> None:
        """Begin; returns at once."""
        threading.Thread(target=self._run, name="kernels", daemon=True).start()

    def close(self) -> None:
        """Compile nothing more. The template's end ends what is being compiled."""
        self._closed = True

    def wait(self, timeout: float | None = None) -> bool:
        """Until everything that can be compiled is; False if that took longer."""
        return self._done.wait(timeout)

    @property
    def known(self) -> bool:
        """Whether it was looked what is on disk."""
        return bool(self._parts) or self._done.is_set()

    @property
    def failed(self) -> list[Part]:
        return [part for part, progress in self._parts.items() if progress.state == "failed"]

    def is_warm(self, kind: str, mode: str) -> bool:
        """Whether requests of that kind and mode need no compiler; a study of accuracy needs all of its kind.

        What could not be compiled beforehand does not wait: its requests are left to try.
        """
        if self._done.is_set():
            return True
        with self._lock:
            concerned = [p for part, p in self._parts.items() if part == (kind, mode)] or [
                p for part, p in self._parts.items() if part[0] == kind
            ]
            return bool(concerned) and all(p.state in ("warm", "failed") for p in concerned)

    def check(self, kind: str, mode: str) -> None:
        """Raises Warming, which tells how long it takes, where the kernels of that kind and mode are not there yet."""
        if not self.is_warm(kind, mode):
            raise Warming(kind, self.warmth(kind).remaining_s)

    def warmths(self) -> list[Warmth]:
        """How far every kind is, in the order in which they are compiled."""
        with self._lock:
            kinds = list(dict.fromkeys(kind for kind, _ in self._parts))
        return [self.warmth(kind) for kind in kinds]

    def warmth(self, kind: str) -> Warmth:
        """How far one kind is."""
        with self._lock:
            states = [p.state for part, p in self._parts.items() if part[0] == kind]
            wing = self._wings.get(kind, _Wing())
            done, of = len(wing.compiled & wing.kernels), len(wing.kernels)
            if not states or "unknown" in states:
                return Warmth(kind, "unknown", 0, 0, 1.0)
            if all(state == "warm" for state in states):
                return Warmth(kind, "warm", of, of, 0.0)
            if set(states) <= {"warm", "failed"}:
                return Warmth(kind, "failed", done, of, 0.0)
            state = "compiling" if {"compiling", "warm"} & set(states) else "waiting"
            return Warmth(kind, state, done, of, self._remaining(kind))

    def _remaining(self, kind: str) -> float:
        """Seconds until the kind is warm, by the pace so far; kinds further ahead come first."""
        left = 0
        for each, wing in self._wings.items():
            open_ = any(p.state in ("waiting", "compiling") for part, p in self._parts.items() if part[0] == each)
            left += len(wing.kernels - wing.compiled) if open_ else 0
            if each == kind:
                break
        compiled = sum(len(wing.compiled & wing.kernels) for wing in self._wings.values()) - self._compiled_before
        elapsed = time.monotonic() - self._began
        pace = (elapsed + _USUAL_S * _WEIGHT) / (compiled + _WEIGHT)
        return max(1.0, left * pace)

    def _run(self) -> None:
        try:
            self._look()
            if self._waiting:
                with suppress(WorkerCrashed):  # it is started anew, and whoever is forked from it prepares for itself
                    self._template.prepare_to_compile()
            threads = [
                threading.Thread(target=self._compile_in_turn, name="kernels", daemon=True)
                for _ in range(min(self._processes, len(self._waiting)))
            ]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        finally:
            self._done.set()

    def _look(self) -> None:
        """What is on disk already. A template that dies meanwhile is started anew by its keeper, and asked again."""
        for _ in range(_ATTEMPTS):
            try:
                child = self._template.fork(tell_what_is_there)
                try:
                    there, kernels, units = child.connection.recv()
                finally:
                    child.kill()
                    self._template.exit_code(child)
                break
            except (WorkerCrashed, EOFError, OSError):
                if self._closed:
                    return
                time.sleep(1.0)
        else:
            logger.error("kernels_unknown")
            return
        with self._lock:
            self._began = time.monotonic()
            self._parts = {part: _Progress("warm" if warm else "waiting") for part, warm in there.items()}
            self._wings = {kind: _Wing(frozenset(names)) for kind, names in kernels.items()}
            for part in (part for part, warm in there.items() if not warm):
                self._waiting.extend(_Step(part, unit) for unit in units[part])
                self._waiting.append(_Step(part))
        for kind in {step.part[0] for step in self._waiting}:
            self._told(self.warmth(kind))

    def _compile_in_turn(self) -> None:
        """One of the processes' turns: the next step that can be done, until there is none."""
        compiler = _Compiler(self._template, self._hear)
        try:
            while (step := self._next()) is not None:
                try:
                    if step.unit:
                        compiler.compile(step)
                    else:
                        self._rehearse(step)
                finally:
                    with self._changed:
                        self._running.remove(step)
                        self._changed.notify_all()
        finally:
            compiler.close()

    def _next(self) -> _Step | None:
        """The first step that waits for nothing: rehearsals wait for the entries ahead of them."""
        with self._changed:
            while self._waiting and not self._closed:
                order = list(self._parts)
                busy = min((order.index(step.part) for step in self._running if step.unit), default=len(order))
                found = next((s for s in self._waiting if s.unit or order.index(s.part) < busy), None)
                if found is not None:
                    self._waiting.remove(found)
                    self._running.append(found)
                    self._parts[found.part].state = "compiling"
                    return found
                self._changed.wait(_BETWEEN_REPORTS_S)
        return None

    def _hear(self, part: Part, names: list[str]) -> None:
        with self._lock:
            for wing in self._wings.values():
                wing.compiled.update(name for name in names if name in wing.kernels)
        self._told(self.warmth(part[0]))

    def _rehearse(self, step: _Step) -> None:
        part, progress = step.part, self._parts[step.part]
        progress.attempts += 1
        state = "warm" if self._solve(part) else "failed"
        with self._lock:
            if state == "failed" and progress.attempts < _ATTEMPTS and not self._closed:
                state = "waiting"
                self._waiting.append(step)
            progress.state = state
        if state == "waiting":
            time.sleep(1.0)
        elif not self._closed:
            now = self.warmth(part[0])
            (logger.error if state == "failed" else logger.info)("kernels", kind=part[0], mode=part[1], state=state)
            self._told(now)

    def _solve(self, part: Part) -> bool:
        try:
            child = self._template.fork(solve_rehearsals, part)
        except WorkerCrashed:
            return False
        try:
            while (told := child.connection.recv()) is not None:
                self._hear(part, told)
            return True
        except (EOFError, OSError):
            return False
        finally:
            child.kill()
            self._template.exit_code(child)


class _Compiler:
    """A process that compiles one bundle after the other: it knows the inner kernels that they share."""

    def __init__(self, template: Template, hear: Callable[[Part, list[str]], None]) -> None:
        self._template, self._hear = template, hear
        self._child: Child | None = None

    def compile(self, step: _Step) -> None:
        """Compile a bundle; whatever cannot be compiled here is left to the rehearsals."""
        try:
            if self._child is None:
                self._child = self._template.fork(compile_units)
            self._child.connection.send(step.unit)
            while (told := self._child.connection.recv()) is not None:
                self._hear(step.part, told)
        except (WorkerCrashed, EOFError, OSError):
            self.close()

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.kill()
            self._template.exit_code(self._child)
            self._child = None


def in_words(warmth: Warmth) -> str:
    """How far a kind's kernels are, as a line."""
    told = {
        "unknown": "looking what is there",
        "waiting": f"{warmth.of} kernels to compile, in about {warmth.remaining_s:.0f} s",
        "compiling": f"{warmth.compiled} of {warmth.of} kernels compiled, about {warmth.remaining_s:.0f} s left",
        "warm": "ready",
        "failed": "its kernels could not be compiled beforehand; each is compiled when it is asked for",
    }
    return f"{warmth.kind:16} {told[warmth.state]}"
