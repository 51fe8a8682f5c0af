"""Compile kernels in child processes: they receive what to compile over a pipe and report which kernels are
compiled."""

from __future__ import annotations

import gc
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import NamedTuple

from app.jobs import warm_markers
from app.jobs.warm_markers import Part


class Unit(NamedTuple):
    """Entries to compile together, by names and types, and the names of all kernels that this compiles."""

    entries: tuple[tuple[str, str], ...]
    kernels: frozenset[str]


_NICENESS = 5
_REPORT_INTERVAL_S = 0.25


def report_compiled(connection: Connection) -> None:
    """Child process: send which parts are compiled, the kernels of each kind with the sizes of their code, and the
    units of uncompiled parts."""
    from app.designs.entries import code_size, name_of, units_of
    from app.designs.rehearsals import PARTS, WINGS
    from solvers.numerics.jit import KERNELS

    sizes = {name_of(kernel): code_size(kernel) for kernel in KERNELS}
    kernels = {
        kind: {name: size for name, size in sizes.items() if name.startswith(wing + ".")}
        for kind, wing in WINGS.items()
    }
    compiled = {part: warm_markers.exists(part) for part in PARTS}
    units = {part: [Unit(*each) for each in units_of(part)] for part, warm in compiled.items() if not warm}
    connection.send((compiled, kernels, units))
    _wait_until_closed(connection)


def compile_units(connection: Connection) -> None:
    """Child process: compile the units received and report compiled kernels."""
    from app.designs.entries import compile_entry

    prepare()
    with suppress(EOFError, OSError):
        while True:
            unit: Unit = connection.recv()
            with _reporting(connection):
                for entry in unit.entries:
                    compile_entry(entry)
            connection.send(None)


def solve_rehearsals(connection: Connection, part: Part) -> None:
    """Child process: solve the part's rehearsals, report compiled kernels, and write the part's marker."""
    from app.designs.rehearsals import rehearsals_of
    from solvers.numerics.jit import KERNELS

    prepare()
    with _reporting(connection):
        for job, request in rehearsals_of(*part):
            job.rehearse(request)
        warm_markers.write(part, [file for kernel in KERNELS for file in kernel.files])
    connection.send(None)
    _wait_until_closed(connection)


def prepare() -> None:
    """Lower this process's priority, and make garbage collection rare."""
    os.nice(_NICENESS)
    # The compiler allocates millions of objects, most of them long-lived; scanning each 200,000 of them took a twelfth
    # of its time. This many new ones occupy about 0.4 GB.
    gc.freeze()
    gc.set_threshold(3_000_000)


@contextmanager
def _reporting(connection: Connection) -> Iterator[None]:
    stopped = threading.Event()
    reporter = threading.Thread(target=_report, args=(connection, stopped), daemon=True)
    reporter.start()
    try:
        yield
    finally:
        stopped.set()
        reporter.join()


def _report(connection: Connection, stopped: threading.Event) -> None:
    from app.designs.entries import name_of
    from solvers.numerics.jit import KERNELS

    reported: set[str] = set()
    while True:
        last = stopped.wait(_REPORT_INTERVAL_S)
        now = {name_of(kernel) for kernel in list(KERNELS) if kernel.is_compiled}
        if now - reported:
            connection.send(sorted(now - reported))
            reported |= now
        if last:
            return


def _wait_until_closed(connection: Connection) -> None:
    """Keep the pipe open until the service has read everything and closes it or kills this process."""
    try:
        connection.recv()
    except (EOFError, OSError):
        return
