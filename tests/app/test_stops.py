"""Stopping the service: at any moment, with all its processes, and without losing accepted runs."""

from __future__ import annotations

import asyncio
import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from itertools import count
from pathlib import Path
from statistics import median
from typing import Any

import httpx
import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of
from app.store.batch_reads import get_batch
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.running import ROOT, Running, parents, wait_until

AT_ONCE_S = 5.0
"""Two seconds on an idle machine; tests run in parallel."""

STUDY = {**example_of(KINDS["flexible-rod"], Mode.ACCURACY), "study_budget_s": 4.0}
CHECK = KINDS["flexible-rod"].example(Mode.CHECK)
ROWS = f"{json.dumps(CHECK)}\n" * 2000
AS_LINES, LATER = {"Content-Type": "application/x-ndjson"}, {"Prefer": "respond-async"}

CAMPAIGN = bool(os.environ.get("CRANKWRIGHT_CAMPAIGN"))
DRAIN_S = 10 if CAMPAIGN else 3
"""The drain, which a half-sent body uses up: in a campaign that of the default."""

TOOK: dict[str, list[float]] = {}
"""Seconds until all processes of a service had ended, by the way it was stopped."""


def noted(what: str, seconds: float) -> float:
    """Record seconds for the statistics of a campaign, and return them."""
    TOOK.setdefault(what, []).append(seconds)
    return seconds


@pytest.fixture(scope="module", autouse=True)
def figures() -> Iterator[None]:
    """Print the statistics of a campaign: count, median and maximum of each, and the machine's load."""
    yield
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg())
    print(f"\nload of the machine over 1, 5, 15 minutes: {load}")
    for what, seconds in TOOK.items():
        print(f"{what}: {len(seconds)} times, median {median(seconds):.2f} s, longest {max(seconds):.2f} s")


def moments(seed: int, longest: float, few: int) -> list[float]:
    """Seconds after the start at which to stop: a few in the suite, 20 in a campaign."""
    return [round(random.Random(seed + k).uniform(0.0, longest), 2) for k in range(20 if CAMPAIGN else few)]


@pytest.mark.parametrize("seconds", moments(1, 5.0, 2))
def test_a_cold_service_ends_at_once_at_any_moment(tmp_path: Path, seconds: float) -> None:
    with Running(tmp_path, cold=True) as service:
        time.sleep(seconds)
        sent = random.Random(seconds).choice([signal.SIGTERM, signal.SIGINT])
        assert noted(f"{sent.name}, idle, kernels compiling", service.end(sent)) < AT_ONCE_S


def test_signals_that_arrive_together_end_a_service(tmp_path: Path) -> None:
    """As from a terminal and from make: the second interrupts the handler of the first."""
    with Running(tmp_path, workers=1, drain_s=DRAIN_S) as service, service.client() as client:
        wait_until(lambda: client.get("/healthz").status_code == 200)
        for _ in range(300):
            service.process.send_signal(signal.SIGTERM)
        assert noted("300 SIGTERM at once", service.end(signal.SIGTERM)) < DRAIN_S + AT_ONCE_S


def test_while_kernels_compile_pages_are_served_and_requests_are_told_how_long_it_takes(tmp_path: Path) -> None:
    with Running(tmp_path, cold=True) as service, service.client() as client:
        wait_until(lambda: "being compiled" in client.get("/").text)
        ready = client.get("/readyz")
        assert ready.status_code == 503
        assert ready.json()["kernels"]["flexible-rod"]["of"] > 0
        refusal = client.post("/api/v1/checks/flexible-rod", json=CHECK)
        assert refusal.status_code == 503
        assert int(refusal.headers["Retry-After"]) >= 1
        assert "are being compiled" in refusal.json()["detail"]
        accepted = client.post("/api/v1/designs/flexible-rod", json=KINDS["flexible-rod"].example(Mode.DESIGN),
                               headers={"Prefer": "respond-async"})  # fmt: skip
        assert accepted.status_code == 202
        assert service.end(signal.SIGTERM) < AT_ONCE_S
    assert "Traceback" not in service.output.read_text()


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory):
    """A warm service on which processes are killed in turn."""
    with Running(tmp_path_factory.mktemp("busy"), workers=2, batch_workers=0) as service, service.client() as client:
        wait_until(lambda: service.ready(client), 170.0)
        yield service, client


def test_a_killed_worker_is_replaced(busy) -> None:
    service, client = busy
    workers = service.family() - {service.pid, service.template}
    for worker in workers:
        # One that was being replaced may have ended by itself.
        with suppress(ProcessLookupError):
            os.kill(worker, signal.SIGKILL)
    wait_until(lambda: not workers & parents().keys(), AT_ONCE_S)
    assert client.post("/api/v1/checks/flexible-rod", json=CHECK).status_code == 201
    wait_until(lambda: service.ready(client) and len(service.family()) == 4)


def test_a_killed_template_takes_its_workers_with_it_and_comes_back(busy) -> None:
    service, client = busy
    template, before = service.template, service.family()
    os.kill(template, signal.SIGKILL)
    wait_until(lambda: not (before - {service.pid}) & parents().keys(), AT_ONCE_S)
    told = client.get("/readyz")
    assert told.status_code == 503 or service.family() - before, "no worker is there, and it says that one is"
    assert client.post("/api/v1/checks/flexible-rod", json=CHECK).status_code == 201
    wait_until(lambda: service.ready(client) and len(service.family()) == 4)
    assert service.template != template


def test_a_killed_service_leaves_nothing(tmp_path: Path) -> None:
    with Running(tmp_path) as service, service.client() as client:
        wait_until(lambda: service.ready(client), 170.0)
        client.post("/api/v1/accuracy/flexible-rod", json=STUDY, headers={"Prefer": "respond-async"})
        assert len(service.family()) >= 4
        assert service.end(signal.SIGKILL) < AT_ONCE_S


def half_sent(address: str) -> socket.socket:
    """A request whose body never comes."""
    host, _, port = address.partition("//")[2].rstrip("/").partition(":")
    connection = socket.create_connection((host, int(port)))
    head = "Host: localhost\r\nContent-Type: application/json\r\nContent-Length: 99"
    connection.sendall(f"POST /api/v1/checks/flexible-rod HTTP/1.1\r\n{head}\r\n\r\n{{".encode())
    return connection


def test_a_busy_service_ends_after_its_drain_and_keeps_what_it_accepted(tmp_path: Path) -> None:
    """Half-sent bodies, a running study, a queue of accepted ones, a check in progress."""
    promised: list[str] = []
    with Running(tmp_path, drain_s=DRAIN_S) as service, service.client() as client:
        wait_until(lambda: service.ready(client), 170.0)
        held = [half_sent(str(client.base_url)) for _ in range(5)]
        for _ in range(4):
            answer = client.post("/api/v1/accuracy/flexible-rod", json=STUDY, headers={"Prefer": "respond-async"})
            assert answer.status_code == 202
            promised.append(answer.headers["Location"])
        statuses: list[int] = []
        asker = threading.Thread(
            target=lambda: statuses.append(client.post("/api/v1/checks/flexible-rod", json=CHECK).status_code)
        )
        asker.start()
        time.sleep(0.5)
        assert service.end(signal.SIGTERM) < DRAIN_S + AT_ONCE_S
        asker.join()
        # Answered within the drain, or refused because the service is stopping; never cut off.
        assert statuses in ([201], [503])
        for connection in held:
            connection.close()
    assert "Traceback" not in service.output.read_text()
    with Running(tmp_path, drain_s=DRAIN_S) as again, again.client() as client:
        known = [client.get(place).json()["status"] for place in promised]
        assert set(known) <= {"queued", "running", "succeeded"}
        last = client.get(promised[0]).json
        wait_until(
            lambda: last()["status"] == "succeeded" or client.get(promised[0]).json()["status"] == "succeeded", 120
        )
        assert again.end(signal.SIGTERM) < DRAIN_S + AT_ONCE_S


class Load:
    """Everything a service can be busy with at once, until it ends: accepted studies, a batch, half-sent bodies, a
    flood of checks. ``kept``: URLs of the accepted runs."""

    def __init__(self, service: Running, client: httpx.Client) -> None:
        self.kept: list[str] = []
        self._held = [half_sent(str(client.base_url)) for _ in range(5)]
        self._ended = threading.Event()
        self._address = client.base_url
        self._posted(client, "/api/v1/batches?kind=flexible-rod&mode=check", content=ROWS, headers=AS_LINES)
        for _ in range(3):
            self._posted(client, "/api/v1/accuracy/flexible-rod", json=STUDY, headers=LATER)
        self._flood = [threading.Thread(target=self._ask) for _ in range(4)]
        for asker in self._flood:
            asker.start()

    def _ask(self) -> None:
        with httpx.Client(base_url=self._address, timeout=60.0) as client, suppress(httpx.HTTPError):
            for turn in count():
                if self._ended.is_set():
                    return
                self._posted(client, "/api/v1/checks/flexible-rod", json=CHECK, headers=LATER if turn % 3 == 0 else {})

    def _posted(self, client: httpx.Client, path: str, **sent: Any) -> None:
        answer = client.post(path, **sent)
        assert answer.status_code in (201, 202, 429, 503), answer.text
        if answer.status_code in (201, 202):
            self.kept.append(answer.headers["Location"])

    def end(self) -> None:
        """After the service's end."""
        self._ended.set()
        for asker in self._flood:
            asker.join()
        for connection in self._held:
            connection.close()


def check_stored(folder: Path, places: list[str]) -> None:
    """Check that what a service that has ended promised at these places can be read, and that nothing is damaged."""

    async def read(store: RunStore) -> None:
        for place in places:
            collection, known = place.split("/")[-2:]
            await (store.get(known) if collection == "runs" else store.query(partial(get_batch, batch_id=known)))

    url = f"sqlite:///{folder}/runs.sqlite3"
    with RunStore(url) as store:
        asyncio.run(read(store))
    assert verify(url).sound


@pytest.mark.parametrize("cold", [False, True], ids=["warm", "compiling"])
@pytest.mark.parametrize("seconds", moments(2, 4.0, 1))
def test_a_loaded_service_ends_at_any_moment_and_keeps_what_it_accepted(
    tmp_path: Path, seconds: float, cold: bool
) -> None:
    with (
        Running(tmp_path, cold=cold, workers=2, batch_workers=1, drain_s=DRAIN_S) as service,
        service.client() as client,
    ):
        if not cold:
            wait_until(lambda: service.ready(client), 170.0)
        load = Load(service, client)
        time.sleep(seconds)
        sent = random.Random(seconds).choice([signal.SIGTERM, signal.SIGTERM, signal.SIGINT])
        took = noted(f"{sent.name}, loaded{', kernels compiling' * cold}", service.end(sent))
        load.end()
        assert took < DRAIN_S + AT_ONCE_S
    assert "Traceback" not in service.output.read_text()
    assert len(load.kept) >= 4
    check_stored(tmp_path, load.kept)


def test_whichever_process_of_a_loaded_service_is_killed_no_other_outlives_what_it_works_for(tmp_path: Path) -> None:
    with Running(tmp_path, workers=2, batch_workers=1) as service, service.client() as client:
        wait_until(lambda: service.ready(client), 170.0)
        load = Load(service, client)
        for turn in range(20 if CAMPAIGN else 3):
            template, before = service.template, service.family()
            # Each process in turn, whatever its id is by then.
            victim = sorted(before - {service.pid})[turn % (len(before) - 1)]
            gone = before - {service.pid} if victim == template else {victim}
            began = time.monotonic()
            os.kill(victim, signal.SIGKILL)
            wait_until(lambda gone=gone: not gone & parents().keys(), AT_ONCE_S)
            noted(
                f"SIGKILL of {'the fork server' if victim == template else 'a worker'}, loaded",
                time.monotonic() - began,
            )
            wait_until(lambda: service.ready(client))
        kept = len(load.kept)
        assert noted("SIGKILL of the service, loaded", service.end(signal.SIGKILL)) < AT_ONCE_S
        load.end()
    # Everything answered before the kill is stored; the last answers may have been in transit.
    check_stored(tmp_path, load.kept[:kept])


RUNNER = """
import sys, time
from pathlib import Path
from tests.app.running import Running
service = Running(Path(sys.argv[1]))
print(service.pid, service.template, flush=True)
time.sleep(60)
"""


def test_a_service_ends_with_the_tests_that_started_it(tmp_path: Path) -> None:
    runner = subprocess.Popen([sys.executable, "-c", RUNNER, str(tmp_path)], stdout=subprocess.PIPE, cwd=ROOT)
    assert runner.stdout is not None
    started = {int(word) for word in runner.stdout.readline().split()}
    assert len(started) == 2
    runner.kill()
    runner.communicate()
    wait_until(lambda: not started & parents().keys(), AT_ONCE_S)
