"""Large batches during interactive use: throughput relative to bulk evaluation, response times, memory.

python -m bench.batches_at_scale                       # 10^6 pin, 10^6 linkage, 10^5 rod checks, 10^4 rod designs
python -m bench.batches_at_scale --share 0.01          # a hundredth of each
python -m bench.batches_at_scale --only "pin checks"   # one of them
Measurements are stored in ``--state`` and not repeated. What follows and the table go into docs/reliability.md. Run it
on an idle machine.

Each batch runs on a fresh service with its own SQLite file, two batch workers and two interactive ones, while /healthz
and an uncached pin check are requested ten times a second.

Bulk rate: two processes that only call the solvers' ``check_many`` on the same cases simultaneously; for designs, which
have no such function, the design. Answer rate: two processes that turn validated requests into answers
(``answers_of``). Both are corrected for the time SQLite alone needs to store the same rows in transactions of the same
size. Two workers compared with one: a twentieth of the rows, in turn on a service with one batch worker and one with
two, medians of five; beside it, what the machine itself allows: two processes compared with one that only call the bulk
functions, in turn too. Processor times are those of the runs with two workers.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import httpx
import psutil

from app.designs.kind import Detail, Mode
from app.designs.many import answers_of
from app.designs.registry import KINDS
from app.store.migrate import upgrade
from bench.batches import bodies, highest_mb, pieces, rested, served, share, timed
from bench.sections import put

PAGE = Path(__file__).parents[1] / "docs" / "reliability.md"
HEADING = "## Large batches"
_INTERVAL_S = 0.1
_TURNS = 5
_LEAST_PRIORITY = 19
_STORED_ROWS = 100_000


@dataclass(frozen=True)
class Subject:
    """A batch: its requests are the example with one number varied, without some of its fields; ``alone`` is how many
    of them one process solves to measure the bulk rate."""

    name: str
    kind: str
    mode: str
    count: int
    alone: int
    without: tuple[str, ...] = ()


SUBJECTS = (
    Subject("pin checks", "pin-profile", "check", 1_000_000, 10_000),
    Subject(
        "linkage checks", "impact-linkage", "check", 1_000_000, 10_000,
        ("drive", "coupler_stiffness_n_m", "length_tolerance_mm"),
    ),
    Subject("rod checks", "flexible-rod", "check", 100_000, 2000),
    Subject("rod designs", "flexible-rod", "design", 10_000, 40),
)  # fmt: skip
"""Linkages have no drive, elastic coupler or tolerances: kinematics, loads, box and circle."""


@dataclass(frozen=True)
class Measured:
    """The figures of one batch; rates are items a second."""

    name: str
    items: int
    stored: int
    succeeded: int
    taken_in_s: float
    rate: float
    bulk_rate: float
    answer_rate: float
    store_rate: float
    bulk_ratio: float
    one_worker: float
    two_workers: float
    workers_us: float
    others_us: float
    healthz_p99_ms: float
    check_p50_ms: float
    check_p99_ms: float
    samples: int
    memory_mb: float
    bytes_per_item: float

    def reached(self, own: float) -> float:
        """The rate relative to ``own``, including storage at SQLite's own rate."""
        return self.rate * (1.0 / own + 1.0 / self.store_rate)


def measured(subject: Subject, count: int, say: Callable[[str], None]) -> Measured:
    """Run one batch and its comparisons."""
    alone = min(subject.alone, max(20, count // 10))
    rows = [*bodies(subject.kind, subject.mode, alone, subject.without)]
    (one, bulk), (_, answers) = (own_rates(rows, subject, way) for way in ("bulk", "answers"))
    say(f"{subject.name}: bulk {bulk:,.0f}/s, {bulk / one:.2f} of one process; answers {answers:,.0f}/s")
    scaled = _one_and_two(subject, max(count // 20, alone))
    say(f"{subject.name}: one worker {scaled['one_worker']:,.0f}/s, two {scaled['two_workers']:,.0f}/s")
    own = {"bulk_rate": bulk, "bulk_ratio": bulk / one, "answer_rate": answers}
    return Measured(subject.name, count, **own, **scaled, **_batch(subject, count))


@contextmanager
def _warm(subject: Subject, workers: int, rows: Iterator[bytes], folder: str) -> Iterator[tuple[int, httpx.Client]]:
    """A service whose workers have solved a few of ``rows``: its process's id, and a client."""
    process, client = served(Path(folder), workers)
    try:
        _ended(client, _sent(client, subject, islice(rows, _first(subject))))
        rested()
        yield process.pid, client
    finally:
        process.kill()
        process.wait()


def _first(subject: Subject) -> int:
    """Items that start the workers and give a first estimate of their time; none of them is measured."""
    return 200 if subject.mode == "check" else 8


def _one_and_two(subject: Subject, count: int) -> dict[str, float]:
    """Items a second of one and two workers, and processor time of an item on two [us]."""
    rates: dict[int, list[float]] = {1: [], 2: []}
    spent = []
    with ExitStack() as stack:
        services = {}
        for workers in rates:
            rows = bodies(subject.kind, subject.mode, _first(subject) + _TURNS * count, subject.without)
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            services[workers] = rows, *stack.enter_context(_warm(subject, workers, rows, folder))
        for _ in range(_TURNS):
            for workers, (rows, pid, client) in services.items():
                own, before = [*islice(rows, count)], _processor_s(pid)
                rates[workers].append(_ended(client, _sent(client, subject, iter(own)))["rate_per_s"])
                if workers == 2:
                    spent.append([1e6 * (b - a) / count for a, b in zip(before, _processor_s(pid), strict=True)])
    workers_us, others_us = (statistics.median(each) for each in zip(*spent, strict=True))
    one, two = (statistics.median(each) for each in rates.values())
    return {"one_worker": one, "two_workers": two, "workers_us": workers_us, "others_us": others_us}


def _processor_s(pid: int) -> tuple[float, float]:
    """Processor time [s] of a service's batch workers, which have the least priority, and of its other processes."""
    found = {True: 0.0, False: 0.0}
    service = psutil.Process(pid)
    for process in (service, *service.children(recursive=True)):
        found[process.nice() == _LEAST_PRIORITY] += sum(process.cpu_times()[:2])
    return found[True], found[False]


def _batch(subject: Subject, count: int) -> dict[str, Any]:
    """One batch on its own service, during interactive use."""
    rows = bodies(subject.kind, subject.mode, _first(subject) + count, subject.without)
    with tempfile.TemporaryDirectory() as folder:
        with _warm(subject, 2, rows, folder) as (pid, client):
            people = _People(client)
            people.start()
            began = time.perf_counter()
            batch = _sent(client, subject, rows)
            taken_in_s = time.perf_counter() - began
            batch = _ended(client, batch)
            people.stop()
            memory = highest_mb(pid)
        file = Path(folder) / "runs.sqlite3"
        stored, chunks, contents = _stored(file)
        return {
            "rate": batch["rate_per_s"],
            "stored": stored - _first(subject),
            "succeeded": batch["items"]["succeeded"],
            "taken_in_s": taken_in_s,
            "store_rate": store_rate(contents, max(1, count // chunks), count),
            "healthz_p99_ms": 1e3 * share(people.health, 0.99),
            "check_p50_ms": 1e3 * share(people.checks, 0.5),
            "check_p99_ms": 1e3 * share(people.checks, 0.99),
            "samples": len(people.checks),
            "memory_mb": memory,
            "bytes_per_item": file.stat().st_size / count,
        }


def _sent(client: httpx.Client, subject: Subject, rows: Iterator[bytes]) -> dict[str, Any]:
    place = f"/api/v1/batches?kind={subject.kind}&mode={subject.mode}"
    form = {"Content-Type": "application/x-ndjson"}
    return client.post(place, content=pieces(rows), headers=form).raise_for_status().json()


def _ended(client: httpx.Client, batch: dict[str, Any]) -> dict[str, Any]:
    while batch["status"] not in ("ended", "cancelled"):
        time.sleep(0.5)
        batch = client.get(batch["links"]["self"]).raise_for_status().json()
    return batch


class _People(threading.Thread):
    """Requests /healthz and single checks until stopped; records response times [s]."""

    def __init__(self, client: httpx.Client) -> None:
        super().__init__(daemon=True)
        self._client = httpx.Client(base_url=client.base_url, timeout=60)
        self._over = threading.Event()
        self.health: list[float] = []
        self.checks: list[float] = []

    def run(self) -> None:
        body, chance = KINDS["pin-profile"].example(Mode.CHECK), random.Random(2)
        while not self._over.wait(_INTERVAL_S):
            body["load"]["force_n"] *= 1.0 - 1e-6 * chance.random()
            self.health.append(timed(lambda: self._client.get("/healthz")))
            self.checks.append(timed(lambda: self._client.post("/api/v1/checks/pin-profile", json=body)))

    def stop(self) -> None:
        self._over.set()
        self.join()


def _stored(file: Path) -> tuple[int, int, list[bytes]]:
    """How many items are stored, in how many chunks, and the contents of some."""
    with sqlite3.connect(file) as connection:
        items = connection.execute("SELECT count(*) FROM batch_items").fetchone()[0]
        chunks = connection.execute("SELECT count(*) FROM batch_chunks").fetchone()[0]
        some = connection.execute("SELECT content FROM batch_items LIMIT 1000").fetchall()
    return items, chunks, [row[0] for row in some]


def store_rate(contents: Sequence[bytes], together: int, count: int) -> float:
    """Rows per second that SQLite alone stores durably in the same table, with the given rows per transaction."""
    insert = (
        'INSERT INTO batch_items (batch, "index", line, status, holds, figure, content, digest) '
        "VALUES (1, ?, ?, 'succeeded', 1, ?, ?, x'00112233445566778899aabbccddeeff')"
    )
    count = min(count, _STORED_ROWS)
    with tempfile.TemporaryDirectory() as name:
        upgrade(f"sqlite:///{name}/bare.sqlite3")
        connection = sqlite3.connect(f"{name}/bare.sqlite3", isolation_level=None)
        connection.execute("PRAGMA synchronous=FULL")
        connection.execute("PRAGMA foreign_keys=OFF")
        began = time.perf_counter()
        for first in range(0, count, together):
            end = min(first + together, count)
            rows = [(k, k + 1, float(k), contents[k % len(contents)]) for k in range(first, end)]
            connection.execute("BEGIN IMMEDIATE")
            connection.executemany(insert, rows)
            connection.execute("COMMIT")
        taken = time.perf_counter() - began
        connection.close()
    return count / taken


def own_rates(rows: Sequence[bytes], subject: Subject, way: str) -> tuple[float, float]:
    """Items per second of one process that solves all rows, and of two, each solving all, simultaneously: in turn."""
    command = [sys.executable, "-m", "bench.batches_at_scale", "--alone", way, subject.kind, subject.mode]
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    both = [subprocess.Popen(command, **pipes, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}) for _ in range(2)]
    for process in both:
        process.stdin.write(b"%d\n" % len(rows) + b"".join(rows))
        process.stdin.flush()
    for process in both:
        assert process.stdout.readline() == b"ready\n"
    rates = [[_together(each, len(rows)) for each in (both[:1], both)] for _ in range(_TURNS)]
    for process in both:
        process.stdin.close()
        process.wait()
    one, two = (statistics.median(each) for each in zip(*rates, strict=True))
    return one, two


def _together(processes: Sequence[subprocess.Popen[bytes]], count: int) -> float:
    """Items per second of these processes, each solving ``count`` simultaneously."""
    for process in processes:
        process.stdin.write(b"\n")
        process.stdin.flush()
    return sum(count / float(process.stdout.readline()) for process in processes)


def _alone(way: str, kind: str, mode: str) -> None:
    """Such a process: reads rows, reports readiness; solves whenever it is told to, and reports the time [s]."""
    count = int(sys.stdin.buffer.readline())
    job = KINDS[kind].jobs[Mode(mode)]
    requests = [job.request.model_validate_json(sys.stdin.buffer.readline()) for _ in range(count)]
    solve = _solver(way, kind, Mode(mode), requests)
    solve(slice(0, max(2, count // 20)))
    print("ready", flush=True)
    while sys.stdin.buffer.readline():
        began = time.perf_counter()
        solve(slice(None))
        print(time.perf_counter() - began, flush=True)


def _solver(way: str, kind: str, mode: Mode, requests: list[Any]) -> Callable[[slice], Any]:
    job = KINDS[kind].jobs[mode]
    if way == "answers":
        return lambda part: list(answers_of(kind, mode, requests[part], Detail.SCALARS))
    if job.run_many is None:
        return lambda part: [job.run(request) for request in requests[part]]
    from app.designs.flexible_rod.kind import case_of as rod_case
    from app.designs.impact_linkage.kind import case_of as linkage_case
    from app.designs.pin_profile.kind import case_of as pin_case
    from solvers import linkage, pin, rod

    case_of, check_many = {
        "pin-profile": (pin_case, pin.check_many),
        "impact-linkage": (linkage_case, linkage.check_many),
        "flexible-rod": (rod_case, rod.check_many),
    }[kind]
    cases = [case_of(request) for request in requests]
    return lambda part: check_many(cases[part])


def section(rows: Sequence[Measured]) -> list[str]:
    """The figures as a section of the page."""
    told = (__doc__ or "").partition("\n\n")[2].partition("\n\n")[2]
    goals = (
        ("items", lambda m: f"{m.items:,}", ""),
        ("stored, each once", lambda m: f"{m.stored:,}", "all"),
        ("succeeded", lambda m: f"{m.succeeded:,}", ""),
        ("received and stored durably [s]", lambda m: f"{m.taken_in_s:.1f}", ""),
        ("items a second", lambda m: f"{m.rate:,.0f}", ""),
        ("bulk functions on two cores [1/s]", lambda m: f"{m.bulk_rate:,.0f}", ""),
        ("requests to answers on two cores [1/s]", lambda m: f"{m.answer_rate:,.0f}", ""),
        ("SQLite alone [1/s]", lambda m: f"{m.store_rate:,.0f}", ""),
        ("of bulk functions and SQLite", lambda m: f"{100 * m.reached(m.bulk_rate):.0f} %", "≥ 60 %"),
        ("of answers and SQLite", lambda m: f"{100 * m.reached(m.answer_rate):.0f} %", ""),
        ("one worker, two workers [1/s]", lambda m: f"{m.one_worker:,.0f}, {m.two_workers:,.0f}", ""),
        ("two workers against one", lambda m: f"{m.two_workers / m.one_worker:.2f}", "≥ 1.7"),
        ("two processes against one, bulk functions alone", lambda m: f"{m.bulk_ratio:.2f}", ""),
        ("processor time of an item: batch workers [µs]", lambda m: f"{m.workers_us:,.0f}", ""),
        ("the same: all other processes of the service [µs]", lambda m: f"{m.others_us:,.0f}", ""),
        ("/healthz, 99 % [ms]", lambda m: f"{m.healthz_p99_ms:.1f}", "≤ 50"),
        ("a single check meanwhile, median [ms]", lambda m: f"{m.check_p50_ms:.0f}", ""),
        ("a single check meanwhile, 99 % [ms]", lambda m: f"{m.check_p99_ms:.0f}", "≤ 300"),
        ("samples of these", lambda m: f"{m.samples:,}", ""),
        ("the service's own process, most memory [MB]", lambda m: f"{m.memory_mb:.0f}", "≤ 500"),
        ("database file for each item [B]", lambda m: f"{m.bytes_per_item:.0f}", ""),
    )  # fmt: skip
    lines = [HEADING, "", told.strip(), "", "| | " + " | ".join(m.name for m in rows) + " | goal |"]
    lines.append("|---|" + "---|" * (len(rows) + 1))
    lines += [f"| {name} | " + " | ".join(tell(m) for m in rows) + f" | {goal} |" for name, tell, goal in goals]
    return [*lines, ""]


def main() -> None:
    """Measure what is missing, and write the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--share", type=float, default=1.0, help="of the full number of items")
    parser.add_argument("--only", help="the name of one batch")
    parser.add_argument("--state", type=Path, help="where figures are kept from one run to the next")
    parser.add_argument("--dry", action="store_true", help="print the table instead of writing it")
    parser.add_argument("--alone", nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.alone:
        _alone(*asked.alone)
        return
    state = asked.state or Path(tempfile.gettempdir()) / f"batches-at-scale-{asked.share:g}.json"
    known = {name: Measured(**told) for name, told in json.loads(state.read_text()).items()} if state.exists() else {}
    for subject in SUBJECTS:
        if subject.name in known or asked.only not in (None, subject.name):
            continue
        began = time.perf_counter()
        known[subject.name] = measured(subject, max(100, round(asked.share * subject.count)), print)
        state.write_text(json.dumps({name: asdict(one) for name, one in known.items()}, indent=1))
        print(f"{subject.name}: {known[subject.name].rate:,.0f}/s, {time.perf_counter() - began:.0f} s in all")
    rows = [known[subject.name] for subject in SUBJECTS if subject.name in known]
    if asked.dry:
        print("\n".join(section(rows)))
    else:
        put(PAGE, HEADING, section(rows))


if __name__ == "__main__":
    main()
