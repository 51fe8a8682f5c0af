"""Short versions of the reliability campaigns, run with the test suite."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.verify import verify
from tests.app.running import Running, wait_until
from tests.reliability.attacks import AT_ONCE as ATTACKERS
from tests.reliability.attacks import attack, told
from tests.reliability.cluster_kills import kill_in_turn
from tests.reliability.descriptors import exhaust
from tests.reliability.disk import cut_and_changed, in_a_faulty_process
from tests.reliability.floods import flooded
from tests.reliability.fuzz import PARSERS, spoil
from tests.reliability.kills import one_round

CAMPAIGN = bool(os.environ.get("CRANKWRIGHT_CAMPAIGN"))
RAW, KILLS, FLOODING = 200, (60 if CAMPAIGN else 1), 24
CHECK = KINDS["crank-masses"].example(Mode.ANALYSIS)


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Running, httpx.Client]]:
    folder = tmp_path_factory.mktemp("attacked")
    settings = {"body_idle_s": 1, "head_timeout_s": 1, "trusted_proxies": "127.0.0.2", "log_level": "info"}
    with Running(folder, **settings) as running, running.client() as client:
        # No wait for kernels: pages, refusals and the analyses used here need none, the rest is answered with 503.
        wait_until(lambda: client.get("/healthz").status_code == 200, 170.0)
        yield running, client


@pytest.mark.timeout(180)
def test_the_service_survives_malformed_requests(service):
    """Short version of ``python -m tests.reliability.attacks``."""
    running, client = service
    outcomes, bad = attack(("127.0.0.1", client.base_url.port), 1, RAW, ATTACKERS)
    print(told(outcomes))
    assert not bad, (told(outcomes), bad[:3])
    assert client.get("/healthz").status_code == 200
    assert "Traceback" not in running.output.read_text()


def test_addresses_of_clients_are_taken_from_trusted_proxies_only(service):
    running, client = service
    for k, source in enumerate(("127.0.0.1", "127.0.0.2")):
        transport = httpx.HTTPTransport(local_address=source)
        with httpx.Client(base_url=client.base_url, transport=transport) as proxy:
            proxy.get("/api/v1/kinds", headers={"X-Forwarded-For": "203.0.113.9", "X-Request-ID": f"proxied-{k}"})
    # A request is logged once its response has gone.
    wait_until(lambda: "proxied-1" in running.output.read_text(), 10.0)
    lines = running.output.read_text().splitlines()
    untrusted, trusted = ("".join(line for line in lines if f"proxied-{k}" in line) for k in (0, 1))
    assert "203.0.113.9" not in untrusted and "127.0.0.1" in untrusted
    assert "203.0.113.9" in trusted


@pytest.mark.timeout(36_000 if CAMPAIGN else 180)
def test_acknowledged_runs_survive_kills(tmp_path: Path):
    """SIGKILL during writes: every run answered with 201 is stored, complete and exactly once."""
    rng, acknowledged = random.Random(1), {}
    for kill in range(KILLS):
        with Running(tmp_path) as running, running.client() as client:
            wait_until(lambda: running.ready(client), 170.0)
            end = time.monotonic() + rng.uniform(0.3, 2.0)
            number = 0
            while time.monotonic() < end:
                headers = {"Idempotency-Key": f"{kill}-{number}"}
                answer = client.post("/api/v1/analyses/crank-masses", json=CHECK, headers=headers)
                assert answer.status_code == 201
                acknowledged[headers["Idempotency-Key"]] = answer.content
                number += 1
            running.end(signal.SIGKILL)
    with Running(tmp_path) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        for key, content in acknowledged.items():
            again = client.post("/api/v1/analyses/crank-masses", json=CHECK, headers={"Idempotency-Key": key})
            assert again.content == content
        running.end(signal.SIGTERM)
    report = verify(f"sqlite:///{tmp_path}/runs.sqlite3")
    assert report.sound and report.runs == report.idempotency_keys and report.runs >= len(acknowledged) > 0
    print(f"{KILLS} kills, {len(acknowledged)} acknowledged runs, none lost")


@pytest.mark.timeout(36_000 if CAMPAIGN else 180)
def test_the_service_recovers_from_descriptor_exhaustion(tmp_path: Path):
    told = exhaust(tmp_path, 50 if CAMPAIGN else 2)
    print(dict(told))
    assert told["on a connection that is open: 201"] > 0


@pytest.mark.timeout(600)
def test_checks_and_health_checks_are_answered_during_floods(tmp_path: Path):
    """Short version of ``python -m tests.reliability.floods``: fewer clients, no bounds on single latencies."""
    with Running(tmp_path, solve_budget_s=1, queue_patience_s=5) as running, running.client() as client:
        wait_until(lambda: running.ready(client), 170.0)
        for name in ("everything", "large bodies", "batches"):
            found, told = flooded(name, 0.5, client, FLOODING)
            print(f"{name}: {found}\n{dict(told)}")
            assert told.total() >= FLOODING and told.keys() <= {"201", "202", "422", "429", "503", "closed"}, told
            assert found.health.at(0.5) < 0.5 and found.checks.at(0.5) < 1.0
        assert "Traceback" not in running.output.read_text()


@pytest.mark.timeout(600)
def test_batches_and_asynchronous_runs_survive_kills(tmp_path: Path):
    """One short round of ``python -m tests.reliability.kills``."""
    found = one_round(tmp_path / "round", f"sqlite:///{tmp_path}/round/runs.sqlite3", 4, 1, 3)
    print(found)
    assert found["items"] > 0


@pytest.mark.timeout(36_000 if CAMPAIGN else 180)
def test_a_batch_survives_kills_of_its_cluster(tmp_path: Path):
    kills, items = (100, 200_000) if CAMPAIGN else (2, 2_000)
    found = kill_in_turn(tmp_path, kills, items)
    print(f"{kills} kills of scheduler and worker: {dict(found)}")
    assert found == {"succeeded": items}


@pytest.mark.timeout(36_000 if CAMPAIGN else 180)
@pytest.mark.parametrize("parser", PARSERS)
def test_parsers_survive_mutated_input(parser):
    """Mutation only; ``python -m tests.reliability.fuzz`` is guided by coverage."""
    number = 100_000 if CAMPAIGN else 150
    understood = spoil(parser, number)
    print(f"{parser}: {number} spoiled examples, {understood} requests understood")
    assert understood > 0


@pytest.mark.timeout(36_000 if CAMPAIGN else 180)
def test_a_damaged_journal_yields_a_complete_prefix(tmp_path: Path):
    places = 900 if CAMPAIGN else 25
    tried = cut_and_changed(places, tmp_path)
    print(dict(tried))
    assert tried.total() == places and len(tried) == 3


@pytest.mark.skipif(sys.platform != "linux", reason="makes calls of the Linux C library fail")
@pytest.mark.timeout(36_000 if CAMPAIGN else 180)
def test_commits_are_atomic_under_disk_failures(tmp_path: Path):
    """Fail every I/O call of three commits and of closing the store, in the suite every seventh."""
    tried = in_a_faulty_process(1 if CAMPAIGN else 7)
    print(dict(tried))
    assert tried["pwrite"] > 5 and tried["fsync"] > 0
