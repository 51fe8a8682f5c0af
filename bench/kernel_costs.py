"""Compilation cost of each kernel: all rehearsals with an empty cache, in one process.

python -m bench.kernel_costs        prints seconds of processor time, most expensive first
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass

MOST = 10


@dataclass(frozen=True)
class Cost:
    """Compilation time [s] of a kernel over all its signatures, excluding the kernels it calls."""

    name: str
    seconds: float
    signatures: int


def measure() -> list[Cost]:
    """All kernels of the project, most expensive first; numba's own code is attributed to the caller."""
    with tempfile.TemporaryDirectory() as empty:
        environment = {**os.environ, "NUMBA_CACHE_DIR": empty, "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(
            [sys.executable, "-m", "bench.kernel_costs", "rows"],
            env=environment, check=True, capture_output=True, text=True,
        )  # fmt: skip
    rows = [line.split("\t") for line in done.stdout.splitlines() if line.count("\t") == 2]
    return [Cost(name, float(seconds), int(signatures)) for name, seconds, signatures in rows]


def table(costs: list[Cost] | None = None) -> list[str]:
    """The most expensive ones, and the sum."""
    costs = measure() if costs is None else costs
    total = sum(cost.seconds for cost in costs)
    lines = ["| kernel | to compile | signatures |", "|---|---|---|"]
    lines += [f"| `{cost.name}` | {cost.seconds:.1f} s | {cost.signatures} |" for cost in costs[:MOST]]
    lines.append(f"| all {len(costs)} | {total:.0f} s | {sum(cost.signatures for cost in costs)} |")
    return lines


def _rows() -> None:
    from numba.core import event

    from app.designs.rehearsals import rehearsals
    from app.jobs.compiling import prepare
    from solvers.numerics.jit import KERNELS

    seconds: dict[str, float] = defaultdict(float)
    signatures: dict[str, int] = defaultdict(int)
    running: list[tuple[str, float, float]] = []

    class Listener(event.Listener):
        def on_start(self, told: event.Event) -> None:
            function = told.data["dispatcher"].py_func
            running.append((f"{function.__module__}.{function.__name__}", time.process_time(), 0.0))

        def on_end(self, told: event.Event) -> None:
            name, began, of_others = running.pop()
            spent = time.process_time() - began
            own = name.startswith("solvers.")
            if own:
                seconds[name] += spent - of_others
                signatures[name] += 1
            # attributed to the caller
            if running:
                above, since, others = running[-1]
                running[-1] = (above, since, others + (spent if own else of_others))

    prepare()
    event.register("numba:compile", Listener())
    for job, request in rehearsals():
        job.rehearse(request)
    for kernel in KERNELS:
        if not kernel.is_compiled:
            print(f"nothing calls {kernel.py_func.__module__}.{kernel.py_func.__name__}", file=sys.stderr)
    for name, spent in sorted(seconds.items(), key=lambda item: -item[1]):
        print(name, f"{spent:.3f}", signatures[name], sep="\t")


if __name__ == "__main__":
    if sys.argv[1:] == ["rows"]:
        _rows()
    else:
        print("\n".join(table()))
