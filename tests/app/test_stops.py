"""How the service ends: at any moment, with all its processes, and with what it had accepted kept."""

from __future__ import annotations

import os
import random
import signal
import socket
import threading
import time
from pathlib import Path

import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS, example_of
from tests.app.running import Running, parents, wait_until

AT_ONCE_S = 5.0
"""Two seconds on a quiet machine; tests run beside others."""
DRAIN_S = 10.0 + AT_ONCE_S

STUDY = {**example_of(KINDS["flexible-rod"], Mode.ACCURACY), "study_budget_s": 4.0}
CHECK = KINDS["flexible-rod"].example(Mode.CHECK)

MOMENTS = 20 if os.environ.get("CRANKWRIGHT_CAMPAIGN") else 3


def moments(seed: int, longest: float) -> list[float]:
    """Seconds after the command at which to stop: a few in the suite, all of them in a campaign."""
    return [round(random.Random(seed + k).uniform(0.0, longest), 2) for k in range(MOMENTS)]


@pytest.mark.parametrize("seconds", moments(1, 5.0))
def test_a_cold_service_ends_at_once_at_any_moment(tmp_path: Path, seconds: float) -> None:
    with Running(tmp_path, cold=True) as service:
        time.sleep(seconds)
        sent = random.Random(seconds).choice([signal.SIGTERM, signal.SIGINT])
        assert service.end(sent) < AT_ONCE_S


def test_while_kernels_compile_pages_are_served_and_requests_are_told_how_long_it_takes(tmp_path: Path) -> None:
    with Running(tmp_path, cold=True) as service, service.client() as client:
        # A template, two workers, two processes that compile.
        wait_until(lambda: len(service.family()) >= 6 or "kernels compiled" in service.output.read_text())
        assert "being compiled" in client.get("/").text
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
    """Half-sent bodies, a running study, a queue of promised ones, a check under way."""
    promised: list[str] = []
    with Running(tmp_path) as service, service.client() as client:
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
        assert service.end(signal.SIGTERM) < DRAIN_S
        asker.join()
        # Answered within the drain, or told that the service stops; never cut off.
        assert statuses in ([201], [503])
        for connection in held:
            connection.close()
    assert "Traceback" not in service.output.read_text()
    with Running(tmp_path) as again, again.client() as client:
        known = [client.get(place).json()["status"] for place in promised]
        assert set(known) <= {"queued", "running", "succeeded"}
        last = client.get(promised[0]).json
        wait_until(
            lambda: last()["status"] == "succeeded" or client.get(promised[0]).json()["status"] == "succeeded", 120
        )
        assert again.end(signal.SIGTERM) < DRAIN_S


@pytest.mark.parametrize("seconds", moments(2, 4.0))
def test_a_busy_service_ends_at_any_moment(tmp_path: Path, seconds: float) -> None:
    with Running(tmp_path) as service, service.client() as client:
        wait_until(lambda: service.ready(client), 170.0)
        for _ in range(3):
            client.post("/api/v1/accuracy/flexible-rod", json=STUDY, headers={"Prefer": "respond-async"})
        time.sleep(seconds)
        assert service.end(random.Random(seconds).choice([signal.SIGTERM, signal.SIGINT])) < DRAIN_S
