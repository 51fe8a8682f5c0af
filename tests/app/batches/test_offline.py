"""Command-line batches without a service: a repeated command resumes and solves nothing twice."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from app.batches import offline
from app.batches.service import BatchService
from app.cli import app
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.errors import Problem
from app.jobs.executor import PoolSettings
from app.logging import get_logger
from app.store.batch_records import BatchRecord
from app.store.errors import StoreError
from app.store.verify import verify
from tests.app.batches.in_process import InProcess

runner = CliRunner()
PIN = KINDS["pin-profile"].example(Mode.CHECK)


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(offline, "ProcessPool", InProcess)


def call(folder: Path, cases: Path, output: Path, *options: str):
    database = f"sqlite:///{folder}/runs.sqlite3"
    command = ["batch", "pin-profile", "check", str(cases), "-o", str(output), "--database-url", database, *options]
    return runner.invoke(app, [*command, "--workers", "1"])


def test_a_table_is_solved_and_exported(tmp_path: Path) -> None:
    cases, output = tmp_path / "cases.ndjson", tmp_path / "results.csv"
    specs = [{**PIN, "load": {"force_n": force}} for force in (4000.0, 5000.0, -1.0)]
    cases.write_text("\n".join(json.dumps(spec) for spec in specs))
    for _ in range(2):
        answer = call(tmp_path, cases, output)
        assert answer.exit_code == 5, answer.output
        assert "3 items: 2 succeeded, 1 refused" in answer.output
    rows = list(csv.DictReader(output.open()))
    assert [row["status"] for row in rows] == ["succeeded", "succeeded", "refused"]
    report = verify(f"sqlite:///{tmp_path}/runs.sqlite3")
    assert (report.damages, report.batch_items) == ((), 3)
    assert not list(tmp_path.glob("*.part"))


def test_invalid_input_is_reported(tmp_path: Path) -> None:
    cases = tmp_path / "cases.csv"
    cases.write_text("nonsense\n1\n")
    for options in ((cases, tmp_path / "r.csv"), (cases, tmp_path / "r.txt"), (tmp_path / "x.doc", tmp_path / "r.csv")):
        answer = call(tmp_path, *options)
        assert answer.exit_code == 2, answer.output


@pytest.mark.usefixtures("in_process")
def test_an_item_stored_without_its_curves_is_reported_with_them(tmp_path: Path) -> None:
    cases, output, page = tmp_path / "cases.ndjson", tmp_path / "results.csv", tmp_path / "report.html"
    cases.write_text(json.dumps(PIN))
    assert call(tmp_path, cases, output).exit_code == 0
    [row] = csv.DictReader(output.open())
    database = f"sqlite:///{tmp_path}/runs.sqlite3"
    answer = runner.invoke(app, ["report", row["run_id"], "-o", str(page), "--database-url", database])
    assert answer.exit_code == 0, answer.output
    assert "data:image/svg" in page.read_text()


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize("suffix", [".ndjson", ".json"])
def test_cases_of_another_file_name_are_solved_as_their_own_batch(tmp_path: Path, suffix: str) -> None:
    cases, output = tmp_path / f"cases{suffix}", tmp_path / "results.csv"
    sweep = {"base": PIN, "vary": {"load.force_n": {"values": [4000.0]}}}
    cases.write_text(json.dumps(PIN if suffix == ".ndjson" else sweep))
    elsewhere = tmp_path / "elsewhere" / cases.name
    elsewhere.parent.mkdir()
    ids = []
    for file in (cases, tmp_path / f"copy{suffix}", elsewhere):
        if file != cases:
            shutil.copy(cases, file)
        answer = call(tmp_path, file, output)
        assert answer.exit_code == 0, answer.output
        [row] = csv.DictReader(output.open())
        ids.append(row["run_id"])
    assert ids[0] != ids[1] and ids[0] == ids[2]


@pytest.mark.parametrize(
    ("cases", "output", "told"),
    [
        ("cases.csv", "none/results.csv", "there is no folder"),
        ("cases.csv", "cases.csv", "has the cases and is not overwritten"),
        ("cases.csv", "linked.csv", "has the cases and is not overwritten"),
        ("cases.csv", "folder.csv", "is a folder"),
        ("none.csv", "results.csv", "there is no file"),
        ("sweep.json", "results.csv", "The sweep cannot be read"),
        ("list.json", "results.csv", "a sweep is a JSON object"),
    ],
)
def test_files_are_checked_before_solving(tmp_path: Path, cases: str, output: str, told: str) -> None:
    (tmp_path / "cases.csv").write_text("name\na\n")
    (tmp_path / "linked.csv").symlink_to(tmp_path / "cases.csv")
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "sweep.json").write_text("{")
    (tmp_path / "list.json").write_text("[]")
    answer = call(tmp_path, tmp_path / cases, tmp_path / output)
    assert answer.exit_code == 2 and told in answer.stderr and len(answer.stderr.splitlines()) == 1
    assert (tmp_path / "cases.csv").read_text() == "name\na\n"


def test_records_are_logged_as_the_settings_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def here(*_given: Any) -> dict[str, Any]:
        get_logger("app.batches.engine").info("below the level")
        get_logger("app.batches.engine").error("batch_chunk_failed", first=0)
        return {"items": {"total": 0, "done": 0, "refused": 0, "failed": 0, "cancelled": 0}}

    monkeypatch.setattr(offline, "here", here)
    monkeypatch.setenv("CRANKWRIGHT_LOG_FORMAT", "json")
    monkeypatch.setenv("CRANKWRIGHT_LOG_LEVEL", "error")
    cases = tmp_path / "cases.ndjson"
    cases.write_text(json.dumps(PIN))
    [line] = call(tmp_path, cases, tmp_path / "results.csv").stderr.splitlines()
    record = json.loads(line)
    assert (record["event"], record["level"], record["first"]) == ("batch_chunk_failed", "error", 0)


def test_a_cancelled_batch_is_told_and_a_repeated_command_starts_a_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cases, output = tmp_path / "cases.ndjson", tmp_path / "results.csv"
    cases.write_text(json.dumps(PIN))
    follow = BatchService.progress

    async def cancelled(service: BatchService, batch_id: str, stopping: Any) -> AsyncIterator[BatchRecord]:
        await service.cancel(batch_id)
        async for batch in follow(service, batch_id, stopping):
            yield batch

    # The engine would solve the only row before it is cancelled.
    monkeypatch.setattr(BatchService, "start", lambda _service: None)
    monkeypatch.setattr(BatchService, "progress", cancelled)
    answer = call(tmp_path, cases, output)
    assert answer.exit_code == 5 and "1 items: 1 cancelled" in answer.stdout, answer.output
    assert "The batch was cancelled; repeat the command" in answer.stderr
    monkeypatch.undo()
    answer = call(tmp_path, cases, output)
    assert answer.exit_code == 0 and "1 items: 1 succeeded" in answer.stdout, answer.output


def test_workers_are_as_the_settings_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[PoolSettings] = []

    def pool(settings: PoolSettings) -> None:
        made.append(settings)
        raise Problem(503, "No pool", "in this test")

    monkeypatch.setattr(offline, "ProcessPool", pool)
    monkeypatch.setenv("CRANKWRIGHT_BATCH_NICENESS", "3")
    monkeypatch.setenv("CRANKWRIGHT_SOLVE_MEMORY_BYTES", str(64 << 20))
    cases = tmp_path / "cases.ndjson"
    cases.write_text(json.dumps(PIN))
    assert "No pool" in call(tmp_path, cases, tmp_path / "results.csv").stderr
    [settings] = made
    assert (settings.background_niceness, settings.memory_bytes, settings.background_workers) == (3, 64 << 20, 1)


def test_a_database_that_cannot_be_used_ends_before_a_pool_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(offline, "ProcessPool", lambda _settings: pytest.fail("a pool was made"))
    cases = tmp_path / "cases.ndjson"
    cases.write_text(json.dumps(PIN))
    answer = runner.invoke(
        app, ["batch", "pin-profile", "check", str(cases), "-o", str(tmp_path / "r.csv"), "--database-url", "nonsense"]
    )
    assert isinstance(answer.exception, StoreError)
