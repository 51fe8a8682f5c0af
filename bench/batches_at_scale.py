"""Large batches during interactive use: throughput relative to bulk evaluation, response times, memory.

python -m bench.batches_at_scale                       # 10^6 pin, 10^6 linkage, 10^5 rod checks, 10^4 rod designs
python -m bench.batches_at_scale --share 0.01          # a hundredth of each
python -m bench.batches_at_scale --only "pin checks"   # one of them

Each batch runs on a fresh service with its own SQLite file, two batch workers and two interactive ones, while /healthz
and an uncached pin check are requested ten times a second. Measurements are stored in ``--state`` and not repeated; the
table goes into docs/reliability.md. Run it on an idle machine.

Bulk rate: two processes that only call the solvers' ``check_many`` on the same cases simultaneously; for designs, which
have no such function, the design. Answer rate: two processes that turn validated requests into answers
(``answers_of``). Both are corrected for the time SQLite alone needs to store the same rows in transactions of the same
size. Two workers compared with one: a twentieth of the rows, on services with one and two batch workers.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import httpx

from app.designs.kind import Detail, Mode
from app.designs.many import answers_of
from app.designs.registry import KINDS
from app.store.migrate import upgrade
from bench.batches import bodies, highest_mb, pieces, rested, served, share, timed
from bench.sections import put

PAGE = Path(__file__).parents[1] / "docs" / "reliability.md"
HEADING = "## Large batches"
_INTERVAL_S = 0.1
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
    one_worker: float
    two_workers: float
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
    bulk, answers = (own_rate(rows, subject, way) for way in ("bulk", "answers"))
    say(f"{subject.name}: bulk {bulk:,.0f}/s, answers {answers:,.0f}/s")
    few = max(count // 20, alone)
    one, two = (_batch(subject, few, workers, False)["rate"] for workers in (1, 2))
    say(f"{subject.name}: one worker {one:,.0f}/s, two {two:,.0f}/s")
    found = _batch(subject, count, 2, True)
    return Measured(subject.name, count, bulk_rate=bulk, answer_rate=answers, one_worker=one, two_workers=two, **found)


def _batch(subject: Subject, count: int, workers: int, watched: bool) -> dict[str, Any]:
    """One batch on its own service; without interactive use, only its rate is measured."""
    with tempfile.TemporaryDirectory() as name:
        process, client = served(Path(name), workers)
        try:
            # warm workers, and an initial estimate of the time per item
            _ended(client, _sent(client, subject, 200 if subject.mode == "check" else 8))
            rested()
            people = _People(client)
            if watched:
                people.start()
            began = time.perf_counter()
            batch = _sent(client, subject, count)
            taken_in_s = time.perf_counter() - began
            batch = _ended(client, batch)
            if not watched:
                return {"rate": batch["rate_per_s"]}
            people.stop()
            memory = highest_mb(process.pid)
        finally:
            process.kill()
            process.wait()
        file = Path(name) / "runs.sqlite3"
        stored, chunks, contents = _stored(file)
        return {
            "rate": batch["rate_per_s"],
            "stored": stored - (200 if subject.mode == "check" else 8),
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


def _sent(client: httpx.Client, subject: Subject, count: int) -> dict[str, Any]:
    place = f"/api/v1/batches?kind={subject.kind}&mode={subject.mode}"
    rows = pieces(bodies(subject.kind, subject.mode, count, subject.without))
    form = {"Content-Type": "application/x-ndjson"}
    return client.post(place, content=rows, headers=form).raise_for_status().json()


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


def own_rate(rows: Sequence[bytes], subject: Subject, way: str) -> float:
    """Items per second of two processes, each solving all rows, simultaneously."""
    command = [sys.executable, "-m", "bench.batches_at_scale", "--alone", way, subject.kind, subject.mode]
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    both = [subprocess.Popen(command, **pipes, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}) for _ in range(2)]
    for process in both:
        process.stdin.write(b"%d\n" % len(rows) + b"".join(rows))
        process.stdin.flush()
    for process in both:
        assert process.stdout.readline() == b"ready\n"
    for process in both:
        process.stdin.write(b"\n")
        process.stdin.flush()
    taken = [float(process.stdout.readline()) for process in both]
    for process in both:
        process.stdin.close()
        process.wait()
    return sum(len(rows) / seconds for seconds in taken)


def _alone(way: str, kind: str, mode: str) -> None:
    """Such a process: reads rows, reports readiness, waits, solves, reports the time [s]."""
    count = int(sys.stdin.buffer.readline())
    job = KINDS[kind].jobs[Mode(mode)]
    requests = [job.request.model_validate_json(sys.stdin.buffer.readline()) for _ in range(count)]
    solve = _solver(way, kind, Mode(mode), requests)
    solve(slice(0, max(2, count // 20)))
    print("ready", flush=True)
    sys.stdin.buffer.readline()
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
        ("two workers against one", lambda m: f"{m.two_workers / m.one_worker:.2f}", "≥ 1.7"),
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
