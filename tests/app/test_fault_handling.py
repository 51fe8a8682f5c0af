"""Faults as seen by clients and operators."""

from __future__ import annotations

import io
import json
import logging
import os
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from fastapi import FastAPI
from prometheus_client import REGISTRY
from sqlalchemy import event
from starlette.testclient import TestClient

from app import metrics
from app.api import operation
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.jobs.errors import BudgetExceeded, MemoryExceeded, SolveFailed, WorkerCrashed
from app.logging import LogFormat, LogLevel, configure
from tests.app.access.keyed import Keyed, keyed
from tests.app.running import ROOT
from tests.app.store.records import make_record
from tests.databases import sqlite_database

MASSES = "/api/v1/analyses/crank-masses"
LINKAGE = "/api/v1/checks/impact-linkage"
BODY = KINDS["crank-masses"].example(Mode.ANALYSIS)


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Keyed]:
    """A service for tests that leave it as it was."""
    with keyed(tmp_path_factory.mktemp("warm")) as service:
        service.warm()
        yield service


def failing(monkeypatch: pytest.MonkeyPatch, service: Keyed, error: Exception) -> None:
    """Every solve of the service ends with this error."""

    async def fail(*_):
        raise error

    monkeypatch.setattr(service.client.app.state.service.executor, "run", fail)


def test_a_damaged_record_is_a_500_without_content(tmp_path):
    with keyed(tmp_path) as service:
        run = make_record(status="failed", result=None, name="rightly")
        service.put([run])
        with sqlite3.connect(tmp_path / "runs.sqlite3") as connection:
            connection.execute("UPDATE runs SET name = 'wrongly'")
        connection.close()
        for path in (f"/api/v1/runs/{run.id}", f"/runs/{run.id}", f"/api/v1/runs/{run.id}/plots/x"):
            answer = service.client.get(path)
            assert answer.status_code == 500 and "damaged" in answer.text and "wrongly" not in answer.text
            assert answer.json()["title"] == "The record is damaged"
        listed = service.client.get("/api/v1/runs").json()
        assert listed["items"] == [] and listed["damaged"] == [run.id]
        assert "wrongly" not in service.client.get("/runs").text


def test_a_deleted_database_is_reported_by_every_route_and_readiness(tmp_path):
    with keyed(tmp_path) as service:
        service.warm()
        assert service.client.post(MASSES, json=BODY).status_code == 201
        assert service.client.get("/readyz").json()["database"] == "ok"
        (tmp_path / "runs.sqlite3").unlink()
        for answer in (service.client.post(MASSES, json=BODY), service.client.get("/api/v1/runs")):
            assert answer.status_code == 503 and int(answer.headers["Retry-After"]) >= 1
            assert "not there any more" in answer.json()["detail"]
        ready = service.client.get("/readyz")
        assert ready.status_code == 503 and "not there" in ready.json()["database"]
        assert service.client.get("/healthz").status_code == 200


def test_a_full_database_is_507(tmp_path):
    with keyed(tmp_path) as service:
        service.warm()
        bound = "PRAGMA max_page_count = 1"  # on every connection from now on: the file does not grow
        event.listen(service.store._engine, "checkout", lambda driver, *_: driver.execute(bound))
        service.store.write_and_wait(lambda connection: connection.exec_driver_sql(bound))
        statuses = [service.client.post(MASSES, json={**BODY, "name": "x" * 200}).status_code for _ in range(12)]
        assert statuses[-1] == 507 and set(statuses) <= {201, 507}
        rows = b"".join(json.dumps({**BODY, "name": os.urandom(99).hex()}).encode() + b"\n" for _ in range(500))
        batch = service.client.post(
            "/api/v1/batches?kind=crank-masses&mode=analysis", content=rows,
            headers={"Content-Type": "application/x-ndjson"},
        )  # fmt: skip
        assert batch.status_code == 507 and service.client.get("/api/v1/batches").json()["items"] == []
        # Acknowledged runs are present.
        assert len(service.client.get("/api/v1/runs").json()["items"]) == statuses.count(201)


def test_request_ids_appear_in_responses_and_logs(warm, monkeypatch):
    stream, root = io.StringIO(), logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    try:
        configure(LogFormat.JSON, LogLevel.INFO, stream)
        given = warm.client.get("/api/v1/runs", headers={"X-Request-ID": "mine-7"})
        made = warm.client.get("/api/v1/runs", headers={"X-Request-ID": "not fit\x7f"})
        monkeypatch.setattr(warm.store, "get", None)  # an unexpected error
        failed = warm.client.get(f"/api/v1/runs/{'0' * 36}", headers={"X-Request-ID": "broken"})
    finally:
        root.handlers[:] = handlers
        root.setLevel(level)
    records = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert given.headers["x-request-id"] == "mine-7" and len(made.headers["x-request-id"]) == 16
    (noted,) = [each for each in records if each.get("request_id") == "mine-7"]
    assert (noted["event"], noted["path"], noted["status"], noted["method"]) == ("request", "/api/v1/runs", 200, "GET")
    assert failed.status_code == 500 and "TypeError" not in failed.text
    told = [each for each in records if each.get("request_id") == "broken"]
    assert any("Traceback" in each.get("exception", "") and "TypeError" in each["exception"] for each in told)


def test_metrics_cover_solves_queues_and_the_store(warm):
    before = warm.client.get("/metrics").text
    assert warm.client.post(MASSES, json=BODY).status_code == 201
    after = warm.client.get("/metrics").text

    def value(text: str, start: str) -> float:
        return sum(float(line.rpartition(" ")[2]) for line in text.splitlines() if line.startswith(start))

    solved = 'crankwright_solves_total{kind="crank-masses",mode="analysis",status="succeeded"}'
    assert value(after, solved) == value(before, solved) + 1
    assert value(after, "crankwright_store_seconds_count") > value(before, "crankwright_store_seconds_count")
    for length in ("short", "long"):
        assert f'crankwright_queue_waiting{{length="{length}"}} 0.0' in after
    assert "crankwright_solve_seconds_bucket" in after and "crankwright_runs_promised" in after


def test_metrics_count_items_of_batches(tmp_path):
    solved = 'crankwright_batch_items_total{kind="crank-masses",mode="analysis",status="succeeded"}'

    def number(name: str) -> float:
        lines = service.client.get("/metrics").text.splitlines()
        return sum(float(line.rpartition(" ")[2]) for line in lines if line.startswith(name + " "))

    with keyed(tmp_path, batch_workers=1, batch_niceness=0) as service:
        service.warm()
        wanted, end = number(solved) + 3, time.monotonic() + 60
        place = "/api/v1/batches?kind=crank-masses&mode=analysis"
        rows = 3 * (json.dumps(BODY).encode() + b"\n")
        assert service.client.post(place, content=rows, headers={"Content-Type": "application/x-ndjson"}).is_success
        while number(solved) < wanted and time.monotonic() < end:
            time.sleep(0.1)
        assert number(solved) == wanted and number("crankwright_batch_items_open") == 0


@pytest.mark.parametrize(("error", "status"), [(BudgetExceeded(1.5), 504), (MemoryExceeded("too much"), 507)])
def test_a_plot_beyond_its_limits_is_a_problem(warm, monkeypatch, error, status):
    plots = warm.client.post(LINKAGE, json=KINDS["impact-linkage"].example(Mode.CHECK)).json()["links"]["plots"]
    failing(monkeypatch, warm, error)
    answer = warm.client.get(plots["loads"])
    assert answer.status_code == status and answer.headers["content-type"] == "application/problem+json"
    if status == 504:
        assert answer.json()["title"] == "The plot took too long to draw" and "1.5 s" in answer.json()["detail"]
        assert int(answer.headers["Retry-After"]) >= 1


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (BudgetExceeded(1.0), "overrun"),
        (MemoryExceeded("too much"), "memory"),
        (WorkerCrashed(-9), "crash"),
        (SolveFailed("ValueError", "Traceback"), "failure"),
    ],
)
def test_metrics_count_solves_without_an_answer_and_effects(warm, monkeypatch, error, reason):
    def number() -> float:
        return metrics.ENDED.labels(reason)._value.get()

    failing(monkeypatch, warm, error)
    before = number()
    answer = warm.client.post("/api/v1/checks/pin-profile", json=KINDS["pin-profile"].example(Mode.CHECK))
    assert answer.json()["status"] == "failed" and number() == before + 1
    effects = (("shear", "skipped"), ("friction", "active"))
    metrics.record_solve("a-kind", "check", "succeeded", 0.1, effects)
    for effect, state in effects:
        labels = {"kind": "a-kind", "effect": effect, "state": state}
        assert REGISTRY.get_sample_value("crankwright_effects_total", labels) >= 1


@pytest.mark.parametrize(
    ("states", "warm", "alive", "statuses"),
    [
        ([], False, True, (200, 503, 503)),  # it is not known yet what has to be compiled
        (["compiling", "warm"], False, True, (200, 503, 503)),
        (["warm", "failed"], True, False, (200, 200, 503)),
        (["warm", "failed"], True, True, (200, 200, 200)),
    ],
)
def test_live_started_and_ready_are_told_apart(states, warm, alive, statuses):
    async def ping() -> None: ...

    kernels = [SimpleNamespace(kind=str(k), state=state, compiled=0, of=1, remaining_s=1.0)
               for k, state in enumerate(states)]  # fmt: skip
    application = FastAPI()
    application.include_router(operation.router)
    application.state.service = SimpleNamespace(
        executor=SimpleNamespace(warmup_status=kernels, warm=warm, ready=alive), store=SimpleNamespace(ping=ping),
        stopping=threading.Event(),
    )  # fmt: skip
    client = TestClient(application)
    assert tuple(client.get(path).status_code for path in ("/healthz", "/startedz", "/readyz")) == statuses
    application.state.service.stopping.set()
    assert client.get("/readyz").status_code == 503


# -- starts -----------------------------------------------------------------------------------------------------


def newer(folder: Path) -> dict[str, str]:
    sqlite_database(folder)
    with sqlite3.connect(folder / "runs.sqlite3") as connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
    connection.close()
    return {}


def no_database(folder: Path) -> dict[str, str]:
    (folder / "runs.sqlite3").write_text("this is a letter, no database\n" * 500)
    return {}


def unprotected(_folder: Path) -> dict[str, str]:
    return {"CRANKWRIGHT_HOST": "0.0.0.0"}


@pytest.mark.parametrize(
    ("prepare", "told"),
    [(newer, "revision 9999"), (no_database, "the database is damaged"), (unprotected, "keys create")],
)
def test_startup_errors_are_one_line(tmp_path, prepare, told):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **prepare(tmp_path)}
    words = ["-m", "app.cli", "serve", "--port", "0", "--database-url", f"sqlite:///{tmp_path}/runs.sqlite3"]
    done = subprocess.run([sys.executable, *words], env=environment, cwd=ROOT, capture_output=True, timeout=100)
    assert done.returncode == 1
    assert told in done.stderr.decode() and len(done.stderr.decode().splitlines()) == 1
