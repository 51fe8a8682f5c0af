"""What the processes do that compile kernels: told over a pipe what, they tell which kernels are there."""

from __future__ import annotations

import gc
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from app.jobs import marks
from app.jobs.marks import Part

Unit = tuple[tuple[str, str], ...]
"""Entries to compile in one go: names and types."""

_NICENESS = 5
_BETWEEN_REPORTS_S = 0.25


def tell_what_is_there(connection: Connection) -> None:
    """In a child: which parts are compiled, the names of the kernels of each kind, the bundles of entries of parts that
    are not."""
    from app.designs.entries import units_of
    from app.designs.rehearsals import PARTS, WINGS
    from solvers.numerics.jit import KERNELS

    names = [_named(kernel) for kernel in KERNELS]
    kernels = {kind: [name for name in names if name.startswith(wing + ".")] for kind, wing in WINGS.items()}
    there = {part: marks.is_left(part) for part in PARTS}
    connection.send((there, kernels, {part: units_of(part) for part, warm in there.items() if not warm}))
    _wait_for_the_end(connection)


def compile_units(connection: Connection) -> None:
    """In a child: compile the bundles that come, telling which kernels are there."""
    from app.designs.entries import compile_entry

    _prepare()
    with suppress(EOFError, OSError):
        while True:
            unit: Unit = connection.recv()
            with _reporting(connection):
                for entry in unit:
                    compile_entry(entry)
            connection.send(None)


def solve_rehearsals(connection: Connection, part: Part) -> None:
    """In a child: solve the part's rehearsals, telling which kernels are there, and leave a mark."""
    from app.designs.rehearsals import rehearsals_of
    from solvers.numerics.jit import KERNELS

    _prepare()
    with _reporting(connection):
        for job, request in rehearsals_of(*part):
            job.rehearse(request)
        marks.leave(part, [file for kernel in KERNELS for file in kernel.files])
    connection.send(None)
    _wait_for_the_end(connection)


def _prepare() -> None:
    os.nice(_NICENESS)
    # The compiler makes millions of objects that live on: looking through them again and again is a fifth of its time.
    gc.freeze()
    gc.set_threshold(200_000, 50, 100)


@contextmanager
def _reporting(connection: Connection) -> Iterator[None]:
    ended = threading.Event()
    reporter = threading.Thread(target=_report, args=(connection, ended), daemon=True)
    reporter.start()
    try:
        yield
    finally:
        ended.set()
        reporter.join()


def _report(connection: Connection, ended: threading.Event) -> None:
    from solvers.numerics.jit import KERNELS

    told: set[str] = set()
    while True:
        last = ended.wait(_BETWEEN_REPORTS_S)
        now = {_named(kernel) for kernel in list(KERNELS) if kernel.is_compiled}
        if now - told:
            connection.send(sorted(now - told))
            told |= now
        if last:
            return


def _named(kernel: Any) -> str:
    return f"{kernel.py_func.__module__}.{kernel.py_func.__name__}"


def _wait_for_the_end(connection: Connection) -> None:
    """The service has read everything when it kills this process or closes the connection."""
    try:
        connection.recv()
    except (EOFError, OSError):
        return
