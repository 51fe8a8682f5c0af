"""The same checks by a batch and by what a user would write.

    python -m bench.batch_rivals            # writes the section of docs/benchmarks.md

One pin, its force another for each check; all ways on this machine, one after the other, timed by the clock from the
first request to the last answer, and by the processor time of all processes that have a part in it. A batch stores its
answers durably; so does a loop of requests to a service. joblib and OpenMDAO call the library's own check; joblib's
two processes keep nothing, OpenMDAO's DOEDriver (ListGenerator, one process) records each case with its SqliteRecorder,
and is left out where OpenMDAO is not installed. Two Dask workers are two `crankwright worker` processes with one batch
worker each, on a scheduler of this machine. Rod checks take longer: with them the processes that solve weigh more than
the one that stores.
Each batch is run three times on one service, with other items each time, and the median counts. Two workers are
compared with one by the rate from the first lease to the last commit: the rows are received before, by one process
however many workers there are.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import httpx

from app.designs.kind import Mode
from app.designs.registry import KINDS
from bench.batches import bodies, pieces, processor_s, rested, served
from bench.sections import put
from solvers import pin

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"
HEADING = "## A batch and what a user would write"
SLUG = "pin-profile"
_FIRST = 400
"""Items of a batch before the measured one: its workers are then started. No item is in both."""
_TIMES = 3
_END_S = 20.0
"""Time a process of a cluster has to end."""
_MORE = 10
"""So many more items a batch has than each of the other ways solves one by one."""


@dataclass(frozen=True)
class Row:
    """A way, and how many items a second it solves; what its rate is to be against, by its name, and by how much."""

    name: str
    rate: Rate
    against: str = ""
    goal: float | None = None


class Rate(NamedTuple):
    """Items a second, and processor time of an item [us]; items a second from a batch's first lease to its last
    commit."""

    per_s: float
    cpu_us: float
    solved_per_s: float | None = None


def _rate(count: int, run: Callable[[], object]) -> Rate:
    """The rate of ``count`` items solved by ``run``."""
    spent, began = processor_s(), time.perf_counter()
    run()
    return Rate(count / (time.perf_counter() - began), 1e6 * (processor_s() - spent) / count)


def batch_rate(kind: str, count: int, workers: int, **environment: str) -> Rate:
    """Rate of a batch, from its sending to its end; its workers have solved some before."""
    with tempfile.TemporaryDirectory() as folder:
        process, client = served(Path(folder), workers, **environment)
        try:
            rows = bodies(kind, Mode.CHECK, _FIRST + _TIMES * count)
            _ended(client, kind, [*islice(rows, _FIRST)])
            rested()
            return sorted(_batch_rate(client, kind, [*islice(rows, count)]) for _ in range(_TIMES))[_TIMES // 2]
        finally:
            process.kill()
            process.wait()


def _batch_rate(client: httpx.Client, kind: str, rows: Sequence[bytes]) -> Rate:
    solved: list[float] = []
    found = _rate(len(rows), lambda: solved.append(_ended(client, kind, rows)))
    return found._replace(solved_per_s=solved[0])


def _ended(client: httpx.Client, kind: str, rows: Sequence[bytes]) -> float:
    """Send a batch and wait for its end; items a second from its first lease to its last commit."""
    sent = client.post(
        f"/api/v1/batches?kind={kind}&mode=check",
        content=pieces(iter(rows)),
        headers={"Content-Type": "application/x-ndjson"},
    ).raise_for_status()
    batch = sent.json()
    while batch["status"] not in ("ended", "cancelled"):
        time.sleep(0.1)
        batch = client.get(batch["links"]["self"]).json()
    assert batch["items"]["succeeded"] == batch["items"]["total"]
    return batch["rate_per_s"]


def request_rate(count: int) -> Rate:
    """Rate of a loop of requests."""
    with tempfile.TemporaryDirectory() as folder:
        process, client = served(Path(folder))
        try:
            rows = [*bodies(SLUG, Mode.CHECK, count + 20)]

            def send(some: Sequence[bytes]) -> None:
                for row in some:
                    client.post(f"/api/v1/checks/{SLUG}", content=row, headers=_JSON).raise_for_status()

            send(rows[count:])
            rested()
            return _rate(count, lambda: send(rows[:count]))
        finally:
            process.kill()
            process.wait()


_JSON = {"Content-Type": "application/json"}


def _case() -> tuple[pin.Scene, pin.Profile]:
    job, example = KINDS[SLUG].jobs[Mode.CHECK], KINDS[SLUG].example(Mode.CHECK)
    request = job.request.model_validate(example)
    return request.scene(), request.given()  # type: ignore[attr-defined]


def _mass_and_use(scene: pin.Scene, profile: pin.Profile, force: float) -> tuple[float, float | None]:
    value = pin.check(replace(scene, force=force), profile).value
    return value.mass, value.strength_utilisation


def _forces(scene: pin.Scene, count: int) -> list[float]:
    return [scene.force * (0.8 + 0.2 * k / count) for k in range(count)]


def joblib_rate(count: int) -> Rate:
    """Rate of joblib's two processes."""
    from joblib import Parallel, delayed

    scene, profile = _case()
    with Parallel(n_jobs=2) as pool:

        def solve(many: int) -> None:
            pool(delayed(_mass_and_use)(scene, profile, force) for force in _forces(scene, many))

        solve(200)
        return _rate(count, lambda: solve(count))


def openmdao_rate(count: int) -> Rate:
    """Rate of OpenMDAO's design of experiments, recorded."""
    import openmdao.api as om

    scene, profile = _case()

    class Pin(om.ExplicitComponent):
        def setup(self) -> None:
            self.add_input("force", scene.force)
            self.add_output("mass", 0.0)
            self.add_output("use", 0.0)
            self.declare_partials("*", "*", method="fd")

        def compute(self, inputs, outputs) -> None:
            outputs["mass"], outputs["use"] = _mass_and_use(scene, profile, float(inputs["force"][0]))

    def run(forces: Sequence[float], folder: str) -> Rate:
        problem = om.Problem(reports=None)
        problem.model.add_subsystem("pin", Pin(), promotes=["*"])
        problem.model.add_design_var("force")
        problem.model.add_objective("mass")
        problem.model.add_constraint("use", upper=1.0)
        problem.driver = om.DOEDriver(om.ListGenerator([[("force", force)] for force in forces]))
        problem.driver.add_recorder(om.SqliteRecorder(f"{folder}/cases-{len(forces)}.sql"))
        problem.setup()

        def drive() -> None:
            problem.run_driver()
            problem.cleanup()

        return _rate(len(forces), drive)

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        run(_forces(scene, 20), folder)
        return run(_forces(scene, count), folder)


OWN_WORKER = ("app.cli", "worker", "--cluster")
DASK_WORKER = ("distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard")


@contextlib.contextmanager
def cluster(workers: int, worker: Sequence[str] = OWN_WORKER) -> Iterator[str]:
    """The address of a Dask scheduler with so many workers of one process each, started by the command ``worker``."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    scheduler = ["-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    commands = [scheduler, *[["-m", *worker, address]] * workers]
    environment = {**os.environ, "CRANKWRIGHT_BATCH_WORKERS": "1", "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "500ms"}
    started: list[subprocess.Popen[bytes]] = []
    try:
        for command in commands:
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started.append(subprocess.Popen([sys.executable, *command], env=environment, **quiet))
            time.sleep(3.0)
        yield address
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            try:
                process.wait(_END_S)
            except subprocess.TimeoutExpired:
                # Dask's own worker sometimes waits forever for a task that it has cancelled.
                process.kill()
                process.wait()


def dask_rate(kind: str, count: int, workers: int) -> Rate:
    """Rate of a batch on a Dask cluster."""
    with cluster(workers) as address:
        return batch_rate(kind, count, workers, CRANKWRIGHT_CLUSTER=address)


def measure(count: int) -> list[Row]:
    """Every way; the slow ones with fewer items."""
    many, rods = _MORE * count, _MORE * count // 2
    ways: list[tuple[str, Callable[[], Rate], str, float | None]] = [
        ("batch, two processes", lambda: batch_rate(SLUG, many, 2), "batch, one process", 1.7),
        ("batch, one process", lambda: batch_rate(SLUG, many, 1), "", None),
        ("batch, two Dask workers", lambda: dask_rate(SLUG, many, 2), "batch, one Dask worker", 1.7),
        ("batch, one Dask worker", lambda: dask_rate(SLUG, many, 1), "", None),
        ("loop of requests", lambda: request_rate(count), "batch, two processes", None),
        ("joblib, two processes", lambda: joblib_rate(many), "batch, two processes", None),
    ]
    if find_spec("openmdao") is not None:
        ways.append(("OpenMDAO, recorded", lambda: openmdao_rate(count), "batch, two processes", None))
    for workers, name in ((2, "two"), (1, "one")):
        ways.append(
            (
                f"rod checks, {name} process{'es' * (workers - 1)}",
                lambda workers=workers: batch_rate("flexible-rod", rods, workers),
                "rod checks, one process" if workers == 2 else "",
                1.7 if workers == 2 else None,
            )
        )
        ways.append(
            (
                f"rod checks, {name} Dask worker{'s' * (workers - 1)}",
                lambda workers=workers: dask_rate("flexible-rod", rods, workers),
                "rod checks, one Dask worker" if workers == 2 else "",
                1.7 if workers == 2 else None,
            )
        )
    rows = []
    for name, run, against, goal in ways:
        rows.append(Row(name, run(), against, goal))
        print(f"{name}: {rows[-1].rate.per_s:,.0f}/s, {rows[-1].rate.cpu_us:,.0f} us", flush=True)
    return rows


def table(rows: Sequence[Row]) -> list[str]:
    """The rows as a table."""
    rates = {row.name: row.rate for row in rows}
    lines = [
        "| way | items a second | from the first lease | processor time of one | against | ratio | goal |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        ratio = f"{_ratio(row.rate, rates[row.against]):.3g}" if row.against else ""
        solved = f"{row.rate.solved_per_s:,.0f}" if row.rate.solved_per_s else ""
        goal = "" if row.goal is None else f"≥ {row.goal:g}"
        spent = f"{row.rate.cpu_us:,.0f} µs"
        lines.append(f"| {row.name} | {row.rate.per_s:,.0f} | {solved} | {spent} | {row.against} | {ratio} | {goal} |")
    if find_spec("openmdao") is None:
        lines += ["", "OpenMDAO is not installed where this was measured."]
    load = os.getloadavg()[0]
    return [*lines, "", f"Load of the machine's {os.cpu_count()} cores at the end: {load:.1f}.", ""]


def _ratio(own: Rate, other: Rate) -> float:
    """How many times the rate of ``other``; of two batches while they were solved."""
    if own.solved_per_s and other.solved_per_s:
        return own.solved_per_s / other.solved_per_s
    return own.per_s / other.per_s


def main() -> None:
    """Measure, and write the section."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=2000, help="of single requests; batches have ten times as many")
    parser.add_argument("--dry", action="store_true", help="print the table instead of writing it")
    asked = parser.parse_args()
    found = table(measure(asked.count))
    if asked.dry:
        print("\n".join(found))
        return
    told = (__doc__ or "").partition("\n\n")[2].partition("\n\n")[2].strip()
    put(PAGE, HEADING, [HEADING, "", told, "", *found])


if __name__ == "__main__":
    main()
