"""Command-line batches without a service: a repeated command resumes and solves nothing twice."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from typer.testing import CliRunner

from app.cli import app
from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.verify import verify

runner = CliRunner()
PIN = KINDS["pin-profile"].example(Mode.CHECK)


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
