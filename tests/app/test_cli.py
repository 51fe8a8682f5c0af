"""The command line."""

from __future__ import annotations

import io
import json
import sqlite3

import pytest
from rich.console import Console
from typer.testing import CliRunner

from app import printing
from app.cli import app
from app.designs.kind import Mode
from app.designs.progress import Progress
from app.designs.registry import KINDS, example_of
from app.printing import shown_progress

runner = CliRunner()


@pytest.fixture
def call(tmp_path):
    database = f"sqlite:///{tmp_path}/runs.sqlite3"

    def run(command: str, kind: str, request: object, *options: str):
        file = tmp_path / "request.json"
        file.write_text(request if isinstance(request, str) else json.dumps(request))
        return runner.invoke(app, [command, kind, str(file), "--database-url", database, *options])

    return run


@pytest.mark.parametrize("mode", [Mode.DESIGN, Mode.CHECK, Mode.ACCURACY])
def test_every_mode_prints_a_readable_table_or_the_run(call, mode):
    request = example_of(KINDS["flexible-rod"], mode)
    table = call(str(mode), "flexible-rod", request)
    assert table.exit_code == 0, table.output
    assert f"flexible-rod · {mode} · succeeded" in table.output
    run = json.loads(call(str(mode), "flexible-rod", request, "--json").output)
    assert run["mode"] == mode
    assert run["result"]


def test_progress_shows_on_a_terminal_and_nowhere_else():
    for terminal in (True, False):
        written = io.StringIO()
        with shown_progress(Console(file=written, force_terminal=terminal)) as report:
            report(Progress(3, 40, "solving at different accuracies"))
        assert ("solving at different accuracies" in written.getvalue() and "3/40" in written.getvalue()) == terminal
        assert terminal or not written.getvalue()


def test_an_accuracy_study_accepts_a_bare_request(call, check_request):
    answer = call("accuracy", "flexible-rod", check_request)
    assert answer.exit_code == 0
    assert "cheapest that will do" in answer.output


def test_an_infeasible_design_is_stored_and_exits_with_3(call, design_request, tmp_path):
    design_request["requirements"]["min_fatigue_safety"] = 6.0
    answer = call("design", "flexible-rod", design_request)
    assert answer.exit_code == 3
    assert "min_fatigue_safety" in answer.output
    assert runner.invoke(app, ["verify", "--database-url", f"sqlite:///{tmp_path}/runs.sqlite3"]).output == (
        "1 runs, 0 damaged\n"
    )


@pytest.mark.parametrize(
    ("command", "kind", "request_text", "told"),
    [
        ("check", "flexible-rod", "{", "not valid"),
        ("accuracy", "flexible-rod", "{", "not valid"),
        ("check", "flexible-rod", "{}", "/mechanism"),
        ("check", "none", "{}", "flexible-rod"),
    ],
)
def test_a_refusal_names_what_is_wrong_and_stores_nothing(call, tmp_path, command, kind, request_text, told):
    answer = call(command, kind, request_text)
    assert answer.exit_code == 2
    assert told in answer.output
    assert not (tmp_path / "runs.sqlite3").exists()


def test_verify_reports_damage(call, check_request, tmp_path):
    call("check", "flexible-rod", check_request)
    with sqlite3.connect(tmp_path / "runs.sqlite3") as database:
        database.execute("UPDATE runs SET result = CAST(replace(CAST(result AS TEXT), '2', '3') AS BLOB)")
    answer = runner.invoke(app, ["verify", "--database-url", f"sqlite:///{tmp_path}/runs.sqlite3"])
    assert answer.exit_code == 1
    assert "1 damaged" in answer.output


def test_a_missing_file(tmp_path):
    answer = runner.invoke(app, ["check", "flexible-rod", str(tmp_path / "none.json")])
    assert answer.exit_code == 2
    assert "cannot be read" in answer.output


def test_a_report_is_written_to_the_given_file(call, tmp_path):
    run = json.loads(call("check", "pin-profile", KINDS["pin-profile"].example(Mode.CHECK), "--json").output)
    database = f"sqlite:///{tmp_path}/runs.sqlite3"
    for name, begin in (("report.pdf", b"%PDF-"), ("report.html", b"<!doctype html>")):
        options = ["-o", str(tmp_path / name), "--database-url", database]
        written = runner.invoke(app, ["report", run["id"], *options])
        assert written.exit_code == 0, written.output
        assert (tmp_path / name).read_bytes().startswith(begin)
    for run_id, name in ((run["id"], "report.txt"), ("no-such-run", "report.pdf")):
        refused = runner.invoke(app, ["report", run_id, "-o", str(tmp_path / name), "--database-url", database])
        assert refused.exit_code == 2


def test_a_margin_of_rounding_is_printed_as_none():
    criterion = {"name": "n", "sense": "at_least", "reached": 2.0, "required": 2.0, "unit": "", "holds": True}
    rows = printing._verdict({"criteria": [criterion | {"margin": 1e-7}], "cautions": []})
    assert dict(rows)["n"].endswith("margin 0 %")
