"""Crash test: SIGKILL of services, worker templates and workers under load of batches and asynchronous runs.

    python -m tests.reliability.kills 1000 .campaign/kills

Each round, on a fresh database, sends batches and asynchronous runs under idempotency keys, retrying until each is
acknowledged, and kills processes at random times. Afterwards everything acknowledged must be stored, complete and
exactly once, and no process may be left. Every round appends a line to ``rounds.jsonl``; the folder of a failed one is
kept with its message, database and service output. A restart continues with the missing rounds. Three rounds run
concurrently.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import random
import shutil
import signal
import sys
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from app.api.contract import PATHS
from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of
from app.store.batch_items import unpacked
from app.store.batch_reads import get_batch, items_after
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.running import Running, parents, wait_until
from tests.databases import fresh_database, postgres_server

KILLS_OF_A_ROUND = 25
SENDERS = 3
LEASE_S = 1.0
BUDGET_S = 300.0
"""Solve budget [s], generous so that solves finish on a loaded machine."""
ENDED_S = 180.0
GONE_S = 15.0
"""Time limit [s] for the orphans of a killed service to exit; immediate on Linux unless the machine is loaded."""


@dataclass(frozen=True)
class Work:
    """A type of request, individualised by one numeric field at ``path``."""

    kind: str
    mode: Mode
    path: tuple[str, str]
    most: int

    def body(self, number: float) -> dict[str, Any]:
        body = json.loads(json.dumps(example_of(KINDS[self.kind], self.mode)))
        body[self.path[0]][self.path[1]] = number
        return body


WORKS = (
    Work("pin-profile", Mode.CHECK, ("load", "force_n"), 1500),
    Work("pin-profile", Mode.DESIGN, ("load", "force_n"), 40),
    Work("impact-linkage", Mode.CHECK, ("limits", "min_link_mm"), 400),
)


@dataclass
class Sent:
    """Acknowledged batches and runs, and failures of the senders."""

    batches: dict[str, tuple[Work, list[float]]] = field(default_factory=dict)
    promised: set[str] = field(default_factory=set)
    stop: threading.Event = field(default_factory=threading.Event)
    faults: list[str] = field(default_factory=list)


def numbers(rng: random.Random, count: int) -> list[float]:
    """Distinct numbers, so that no request is answered from the cache."""
    return [round(0.5 + 1e-4 * k + rng.random() * 1e-5, 9) for k in range(count)]


class Sender(threading.Thread):
    """Sends requests until stopped; unanswered ones are retried under the same idempotency key."""

    def __init__(self, rng: random.Random, sent: Sent, address: Callable[[], str]) -> None:
        super().__init__(name="sender", daemon=True)
        self._rng, self._sent, self._address = rng, sent, address

    def run(self) -> None:
        try:
            while not self._sent.stop.is_set():
                self._one_batch() if self._rng.random() < 0.7 else self._one_promise()
                self._sent.stop.wait(self._rng.uniform(0.0, 0.5))
        except Exception:
            self._sent.faults.append(traceback.format_exc())

    def _one_batch(self) -> None:
        rng, work = self._rng, self._rng.choice(WORKS)
        numbered = numbers(rng, int(work.most ** rng.uniform(0.1, 1.0)))
        base = example_of(KINDS[work.kind], work.mode)[work.path[0]][work.path[1]]
        numbered = [base * each for each in numbered]
        lines = [json.dumps(work.body(each)).encode() + b"\n" for each in numbered]
        pause_s = rng.choice((0.0, 0.0, 0.5 / len(lines)))

        def stream() -> Iterator[bytes]:
            for line in lines:
                if pause_s:
                    time.sleep(pause_s)
                yield line

        query = {"kind": work.kind, "mode": str(work.mode)}
        headers = {"Content-Type": "application/x-ndjson"}
        shown = self._acknowledged("/api/v1/batches", headers, lambda: stream() if pause_s else b"".join(lines), query)
        if shown is not None:
            self._sent.batches[shown["id"]] = (work, numbered)

    def _one_promise(self) -> None:
        kind, mode = self._rng.choice((("pin-profile", Mode.DESIGN), ("flexible-rod", Mode.ACCURACY)))
        asked = example_of(KINDS[kind], mode) | ({"study_budget_s": 1.0} if mode is Mode.ACCURACY else {})
        body = json.dumps(asked | {"name": f"{self._rng.random()}"} if mode is Mode.DESIGN else asked).encode()
        headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
        shown = self._acknowledged(f"/api/v1/{PATHS[mode]}/{kind}", headers, lambda: body, {})
        if shown is not None:
            self._sent.promised.add(shown["id"])

    def _acknowledged(
        self, path: str, headers: dict[str, str], content: Callable[[], Any], query: dict[str, str]
    ) -> dict[str, Any] | None:
        """Retry until a 202 answer; None if the round ends first."""
        headers = {**headers, "Idempotency-Key": f"{self._rng.getrandbits(64):x}"}
        while not self._sent.stop.is_set():
            try:
                answer = httpx.post(
                    self._address() + path, content=content(), headers=headers, params=query, timeout=60
                )
            except httpx.TransportError:
                time.sleep(0.05)
                continue
            if answer.status_code == 202:
                return answer.json()
            if answer.status_code not in (408, 429, 503):
                raise AssertionError(f"{answer.status_code} {answer.text[:300]}")
            time.sleep(0.2)
        return None


class Round:
    """One database with one or two services, and the kills inflicted on them."""

    def __init__(self, folder: Path, url: str, seed: int, services: int) -> None:
        self.folder, self.url, self.rng = folder, url, random.Random(seed)
        self.killed: Counter[str] = Counter()
        self.sent = Sent()
        self._starts = 0
        self.services: list[tuple[Running, str]] = [self._start_service() for _ in range(services)]

    def _start_service(self) -> tuple[Running, str]:
        self._starts += 1
        folder = self.folder / f"service-{self._starts}"
        folder.mkdir(parents=True)
        settings = {
            "workers": 1,
            "batch_workers": 2,
            "lease_s": LEASE_S,
            "batch_niceness": 0,
            "solve_budget_s": BUDGET_S,
        }
        running = Running(folder, url=self.url, **settings)
        with running.client() as client:
            return running, str(client.base_url).rstrip("/")

    def address(self) -> str:
        return self.rng.choice(self.services)[1]

    def go(self, kills: int) -> None:
        senders = [Sender(random.Random(self.rng.random()), self.sent, self.address) for _ in range(SENDERS)]
        for sender in senders:
            sender.start()
        wait_until(lambda: self.sent.batches or self.sent.faults, 120.0)
        while self.killed.total() < kills:
            time.sleep(self.rng.uniform(0.0, 1.5))
            self._kill()
        self.sent.stop.set()
        for sender in senders:
            sender.join(90.0)
        assert not self.sent.faults, self.sent.faults
        assert not any(sender.is_alive() for sender in senders)

    def _kill(self) -> None:
        at = self.rng.randrange(len(self.services))
        running = self.services[at][0]
        what = self.rng.choices(("service", "worker", "template"), (2, 6, 1))[0]
        if what == "service":
            family = running.family()
            os.kill(running.pid, signal.SIGKILL)
            running.process.wait()
            wait_until(lambda: not family & parents().keys(), GONE_S)
            self.services[at] = self._start_service()
            if self.rng.random() < 0.7:  # else the next kill may hit a starting service
                self._wait_until_it_works(self.services[at][1])
        else:
            templates = {pid for pid, parent in parents().items() if parent == running.pid}
            workers = running.family() - {running.pid} - templates
            pid = self.rng.choice(sorted(workers if what == "worker" else templates) or [0])
            if not pid:
                return
            with contextlib.suppress(ProcessLookupError):  # it has just exited
                os.kill(pid, signal.SIGKILL)
        self.killed[what] += 1

    @staticmethod
    def _wait_until_it_works(address: str) -> None:
        with httpx.Client(base_url=address, timeout=60) as client:
            wait_until(lambda: client.get("/readyz").status_code == 200, 120.0)

    def check(self) -> dict[str, int]:
        """Assert that everything acknowledged is stored completely and exactly once; returns the counts."""
        with httpx.Client(base_url=self.services[0][1], timeout=60) as client:
            for batch in self.sent.batches:
                wait_until(
                    lambda b=batch: self._finished(client, f"/api/v1/batches/{b}", ("queued", "running")), ENDED_S
                )
            for run in self.sent.promised:
                wait_until(lambda r=run: self._finished(client, f"/api/v1/runs/{r}", ("queued", "running")), ENDED_S)
                shown = client.get(f"/api/v1/runs/{run}").json()
                assert shown["status"] in ("succeeded", "infeasible"), shown
        for running, _ in self.services:
            running.end(signal.SIGTERM)
        with RunStore(self.url) as store:
            items = sum(self._check_batch(store, *entry) for entry in self.sent.batches.items())
        report = verify(self.url)
        assert report.sound, report.damages
        assert report.batch_items == items, (report.batch_items, items)
        for running, _ in self.services:
            assert "Traceback" not in running.output.read_text(), running.output
        return {"batches": len(self.sent.batches), "items": items, "promised": len(self.sent.promised)}

    @staticmethod
    def _finished(client: httpx.Client, place: str, still: tuple[str, ...]) -> bool:
        time.sleep(0.05)
        return client.get(place).json()["status"] not in still

    @staticmethod
    def _check_batch(store: RunStore, batch_id: str, sent: tuple[Work, list[float]]) -> int:
        work, numbered = sent
        batch = store.read(lambda connection: get_batch(connection, batch_id))
        items = store.read(lambda connection: items_after(connection, batch.number, -1, 10**7))
        assert batch.total == batch.done == len(numbered) and not batch.failed and not batch.refused, batch
        assert [item.index for item in items] == list(range(len(numbered)))
        for item, number in zip(items, numbered, strict=True):
            spec = unpacked(item.content, batch.dictionary)["spec"]
            assert spec[work.path[0]][work.path[1]] == number, (batch_id, item.index)
        return len(items)

    def close(self) -> None:
        self.sent.stop.set()
        for running, _ in self.services:
            running.__exit__()


def one_round(folder: Path, url: str, seed: int, services: int, kills: int) -> dict[str, Any]:
    """Run one round; returns its counts. On failure raises and keeps the folder."""
    folder.mkdir(parents=True)
    began = time.monotonic()
    round_ = Round(folder, url, seed, services)
    try:
        round_.go(kills)
        found = round_.check()
    finally:
        round_.close()
    shutil.rmtree(folder)
    return {**round_.killed, **found, "seconds": round(time.monotonic() - began, 1)}


def told_round(server: str, folder: Path, seed: int) -> dict[str, Any]:
    """Run one round and report it; seeds alternate over SQLite and PostgreSQL, with one service and two."""
    where, services, on_server = folder / f"round-{seed}", 1 + seed % 2, seed % 4 >= 2
    database = fresh_database(server) if on_server else contextlib.nullcontext(f"sqlite:///{where}/runs.sqlite3")
    line = {"seed": seed, "database": "postgresql" if on_server else "sqlite", "services": services}
    line |= {"kills": KILLS_OF_A_ROUND, "failure": None}
    shutil.rmtree(where, ignore_errors=True)  # left by an interrupted campaign
    with database as url:
        try:
            line |= one_round(where, url, seed, services, KILLS_OF_A_ROUND)
        except Exception:
            line["failure"] = traceback.format_exc()
            (where / "failure.txt").write_text(line["failure"])
    return line


def campaign(kills: int, folder: Path, until: float = float("inf"), at_once: int = 3) -> list[dict[str, Any]]:
    """Run rounds concurrently until ``kills`` or the time ``until`` is reached; returns all reports ever made."""
    folder.mkdir(parents=True, exist_ok=True)
    told = folder / "rounds.jsonl"
    done = [json.loads(line) for line in told.read_text().splitlines()] if told.exists() else []
    begun = {line["seed"] for line in done}
    seeds = (seed for seed in itertools.count() if seed not in begun)
    wanted = -(-(kills - sum(line["kills"] for line in done)) // KILLS_OF_A_ROUND)
    # Long-lived threads: a child process ends with the thread that started it.
    with postgres_server() as server, ThreadPoolExecutor(at_once) as threads, told.open("a") as sink:

        def one(seed: int) -> dict[str, Any] | None:
            return told_round(server, folder, seed) if time.time() < until else None

        for ended in as_completed([threads.submit(one, seed) for seed in itertools.islice(seeds, max(0, wanted))]):
            if (line := ended.result()) is not None:
                done.append(line)
                for out in (sink, sys.stdout):
                    print(json.dumps(line), file=out, flush=True)
    return done


if __name__ == "__main__":
    rounds = campaign(int(sys.argv[1]), Path(sys.argv[2]), time.time() + float((sys.argv[3:] or ["inf"])[0]))
    sys.exit(any(line["failure"] for line in rounds))
