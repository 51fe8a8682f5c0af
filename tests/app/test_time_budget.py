"""The time budget of a request: at most the service's, passed to solvers that watch the clock, enforced for all
others."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import pytest

from app import submission
from app.designs.kind import Answer, Mode
from app.designs.problems import OUT_OF_TIME
from app.designs.registry import KINDS
from app.designs.schema import envelope
from app.encoded_answer import EncodedAnswer
from app.store.repository import RunStore
from app.submission import Service
from solvers.outcome import Accuracy, Outcome, Status
from tests.databases import sqlite_database

DESIGNS = [kind for kind in KINDS.values() if Mode.DESIGN in kind.jobs]


@cache
def example_result() -> dict:
    """The result of the rod example."""
    rod = KINDS["flexible-rod"]
    job = rod.jobs[Mode.DESIGN]
    return job.run(job.request.model_validate(rod.example(Mode.DESIGN))).result


class Recording:
    """An executor that records its calls; its answers have the accuracy ``estimated``."""

    def __init__(self, estimated: float = 0.0, judged: bool = True) -> None:
        self.calls: list[tuple[float | None, float]] = []
        self._verdict = {"holds": True} if judged else None
        self._accuracy = {"requested": 1e-6, "estimated": estimated, "met": estimated <= 1e-6, "settings": {}}

    def start(self) -> None: ...

    async def run(self, _kind: str, _mode: str, payload: bytes, budget_s: float, _report: object) -> EncodedAnswer:
        self.calls.append((json.loads(payload)["time_budget_s"], budget_s))
        answer = Answer("succeeded", example_result(), [], self._accuracy, {}, None, self._verdict)
        return EncodedAnswer.of("flexible-rod", Mode.DESIGN, answer)

    def close(self) -> None: ...


@pytest.fixture
def store(tmp_path) -> Iterator[RunStore]:
    with RunStore(sqlite_database(tmp_path)) as opened:
        yield opened


def solve(store, executor, monkeypatch, asked: float | None, best_in_time: bool):
    rod = KINDS["flexible-rod"]
    job = replace(rod.jobs[Mode.DESIGN], best_in_time=best_in_time)
    monkeypatch.setattr(submission, "job_of", lambda _kind, _mode: job)
    request = job.request.model_validate({**rod.example(Mode.DESIGN), "time_budget_s": asked})

    async def submitted():
        response = await Service(store, executor, 10.0).submit(rod, Mode.DESIGN, request, None, "")
        return await store.get(response.run_id)

    return asyncio.run(submitted())


@pytest.mark.parametrize(
    ("asked", "best_in_time", "told", "killed"),
    [(None, False, None, 10.0), (2.0, False, 2.0, 2.0), (2.0, True, 2.0, 3.0), (None, True, 9.0, 10.0)],
)
def test_the_solvers_limit_and_the_kill_timeout(store, monkeypatch, asked, best_in_time, told, killed):
    executor = Recording()
    run = solve(store, executor, monkeypatch, asked, best_in_time)
    assert executor.calls == [(told, killed)]
    assert json.loads(run.spec)["time_budget_s"] == asked, "the stored request is the user's"


@pytest.mark.parametrize(("estimated", "solved"), [(1e-9, 1), (1e-3, 2)])
def test_a_result_limited_by_time_is_not_cached(store, monkeypatch, estimated, solved):
    """Unless it met the requested accuracy, in which case more time would not help."""
    executor = Recording(estimated)
    for _ in range(2):
        solve(store, executor, monkeypatch, 2.0, True)
    assert len(executor.calls) == solved


def test_a_cached_answer_without_a_verdict_is_not_reused(store, monkeypatch):
    old, new = Recording(judged=False), Recording()
    runs = [solve(store, executor, monkeypatch, None, True) for executor in (old, new, new)]
    assert [run.verdict for run in runs] == [None, b'{"holds":true}', b'{"holds":true}']
    assert [run.holds for run in runs] == [None, True, True]
    assert len(new.calls) == 1


@pytest.mark.parametrize("kind", DESIGNS, ids=lambda kind: kind.slug)
@pytest.mark.parametrize("seconds", [0.0, -1.0, 61.0, 4000.0])
def test_a_budget_above_the_services_limit_is_refused(client, kind, seconds):
    body = {**kind.example(Mode.DESIGN), "time_budget_s": seconds}
    answer = client.post(f"/api/v1/designs/{kind.slug}", json=body)
    assert answer.status_code == 422
    (entry,) = answer.json()["errors"]
    assert entry["pointer"] == "/time_budget_s"


def test_a_check_has_no_time_budget(client, check_request):
    answer = client.post("/api/v1/checks/flexible-rod", json={**check_request, "time_budget_s": 5.0})
    assert answer.json()["errors"][0]["pointer"] == "/time_budget_s"


def test_no_result_in_time_is_a_problem():
    told = envelope(None, Outcome(Status.FAILED, None, (), Accuracy(1e-6, 1.0)), {"diagnosis": []})
    assert told.status == "failed" and told.result is None
    assert told.problem["title"] == OUT_OF_TIME and told.problem["status"] == 504


SLOW = {"front": {"against": "longest_link", "points": 20}, "accuracy": 1e-9}


def test_a_design_that_ignores_the_clock_is_killed(client):
    body = {**KINDS["impact-linkage"].example(Mode.DESIGN), **SLOW, "time_budget_s": 0.01}
    run = client.post("/api/v1/designs/impact-linkage", json=body).json()
    assert run["status"] == "failed" and run["result"] is None
    assert run["problem"]["status"] == 504 and "0.01 s" in run["problem"]["detail"]


def test_a_rod_design_out_of_time_returns_the_best_found(client, design_request):
    requirements = {"min_fatigue_safety": 2.65, "min_stability_safety": 1.8}
    body = {**design_request, "requirements": requirements, "effects": "all", "accuracy": 1e-9, "time_budget_s": 0.02}
    run = client.post("/api/v1/designs/flexible-rod", json=body).json()
    assert run["status"] == "succeeded"
    assert all(run["result"][name.removeprefix("min_")] >= least for name, least in requirements.items())
    assert run["accuracy"]["met"] is False
    assert ["is not met" in text or "time budget" in text for text in run["result"]["warnings"]] == [True, True]
    assert run["result"]["certificate"]["gap"] > 1e-9


def test_the_command_line_enforces_the_budget(tmp_path):
    from typer.testing import CliRunner

    from app.cli import app

    file = tmp_path / "request.json"
    file.write_text(json.dumps({**KINDS["impact-linkage"].example(Mode.DESIGN), **SLOW, "time_budget_s": 0.01}))
    database = f"sqlite:///{tmp_path}/runs.sqlite3"
    done = CliRunner().invoke(app, ["design", "impact-linkage", str(file), "--json", "--database-url", database])
    assert done.exit_code == 3
    assert json.loads(done.stdout)["problem"]["title"] == OUT_OF_TIME
