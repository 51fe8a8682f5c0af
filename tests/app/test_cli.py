"""The command line."""

from __future__ import annotations

import io
import json
import sqlite3
import subprocess
import sys
from codecs import BOM_UTF8

import pytest
from rich.console import Console
from typer.testing import CliRunner

from app import printing
from app.cli import app, main
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
    (tmp_path / "other.sqlite3").write_bytes(b"no database " * 100)
    answer = runner.invoke(app, ["verify", "--database-url", f"sqlite:///{tmp_path}/other.sqlite3"])
    assert answer.output.splitlines()[0] == "the database cannot be read: file is not a database"


def test_a_missing_file(tmp_path):
    answer = runner.invoke(app, ["check", "flexible-rod", str(tmp_path / "none.json")])
    assert answer.exit_code == 2
    assert "cannot be read" in answer.output


def test_a_byte_order_mark_before_the_request_is_left_out(tmp_path, check_request):
    file, database = tmp_path / "request.json", f"sqlite:///{tmp_path}/runs.sqlite3"
    file.write_bytes(BOM_UTF8 + json.dumps(check_request).encode())
    answer = runner.invoke(app, ["check", "flexible-rod", str(file), "--database-url", database])
    assert answer.exit_code == 0, answer.output


@pytest.fixture
def error_line(monkeypatch, capsys):
    """The only line that a failing command prints."""

    def run(*words: str) -> str:
        monkeypatch.setattr(sys, "argv", ["crankwright", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 1
        printed = capsys.readouterr()
        assert printed.out == ""
        [line] = printed.err.splitlines()
        return line

    return run


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("WORKERS", "abc", "a whole number"),
        ("WORKERS", "0", "at least 1"),
        ("SOLVE_MEMORY_BYTES", "1", "at least 16777216"),
        ("SOLVE_BUDGET_S", "long", "a number"),
        ("LOG_FORMAT", "xml", "'console' or 'json'"),
        ("OPEN", "perhaps", "true or false"),
    ],
)
def test_a_setting_that_cannot_be_is_told_in_a_line(error_line, monkeypatch, tmp_path, name, value, allowed):
    monkeypatch.setenv(f"CRANKWRIGHT_{name}", value)
    cases = tmp_path / "cases.csv"
    cases.write_text("name\na\n")
    for command in (["serve"], ["batch", "pin-profile", "check", str(cases), "-o", str(tmp_path / "results.csv")]):
        told = error_line(*command, "--database-url", f"sqlite:///{tmp_path}/runs.sqlite3")
        assert told == f"CRANKWRIGHT_{name} is '{value}': allowed is {allowed}"


@pytest.mark.parametrize(
    ("url", "began"),
    [
        ("nonsense", "nonsense"),
        ("mysql://me:secret@host/runs", "mysql"),
        ("postgresql+asyncpg://me:secret@host/runs", "postgresql+asyncpg"),
        ("postgresql://me:secret@host:port/runs", "postgresql"),
        ("sqlite://", "sqlite"),
    ],
)
@pytest.mark.parametrize("command", [["keys", "list"], ["verify"], ["migrate"], ["serve"]])
def test_a_database_url_that_cannot_be_used_is_told_in_a_line(error_line, command, url, began):
    told = error_line(*command, "--database-url", url)
    assert f"CRANKWRIGHT_DATABASE_URL or --database-url begins with '{began}'" in told
    assert "allowed is sqlite:///path/to/file or postgresql://" in told and "secret" not in told


def test_a_password_file_that_cannot_be_read_is_told_in_a_line(error_line, monkeypatch, tmp_path):
    monkeypatch.setenv("CRANKWRIGHT_DATABASE_PASSWORD_FILE", str(tmp_path / "none"))
    told = error_line("verify", "--database-url", "postgresql://me@host/runs")
    assert told.startswith(f"CRANKWRIGHT_DATABASE_PASSWORD_FILE: {tmp_path}/none cannot be read")


@pytest.mark.parametrize(
    "command",
    [
        ["verify"], ["keys", "list"], ["keys", "revoke", "none"], ["audit"], ["report", "none"], ["backup", "copy"],
        ["prune", "--before", "2026-01-31"],
    ],
)  # fmt: skip
def test_commands_that_need_a_database_make_none(error_line, monkeypatch, tmp_path, command):
    monkeypatch.chdir(tmp_path)
    assert error_line(*command, "--database-url", "sqlite:///none/runs.sqlite3") == (
        "there is no database at none/runs.sqlite3"
    )
    assert not list(tmp_path.iterdir())


def test_output_that_cannot_be_written_is_told_in_a_line():
    with open("/dev/full", "w") as full:
        ended = subprocess.run(
            [sys.executable, "-m", "app.cli", "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (ended.returncode, ended.stderr) == (1, "[Errno 28] No space left on device\n")


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
