"""The command line: serve, design, check, migrate, verify, and the first run that `make run` shows."""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer

app = typer.Typer(
    name="crankwright",
    help="Design optimization for crank mechanisms. CRANKWRIGHT_* variables set the same things as the options.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

DatabaseUrl = Annotated[
    str, typer.Option(envvar="CRANKWRIGHT_DATABASE_URL", help="where runs are stored (SQLAlchemy URL)")
]
AsJson = Annotated[bool, typer.Option("--json", help="print the run as JSON")]
_DATABASE = "sqlite:///crankwright.sqlite3"


@app.command()
def serve(
    host: Annotated[str, typer.Option(envvar="CRANKWRIGHT_HOST")] = "127.0.0.1",
    port: Annotated[int, typer.Option(envvar="CRANKWRIGHT_PORT", min=0, max=65535)] = 8000,
    database_url: DatabaseUrl = _DATABASE,
) -> None:
    """Migrate the database and serve the API and the pages."""
    import uvicorn

    os.environ["CRANKWRIGHT_DATABASE_URL"] = database_url
    typer.echo(f"Crankwright      http://{host}:{port}/")
    typer.echo(f"API reference    http://{host}:{port}/docs")
    uvicorn.run("app.main:create_app", factory=True, host=host, port=port, log_level="warning")


@app.command()
def migrate(database_url: DatabaseUrl = _DATABASE) -> None:
    """Bring the database to this version's schema."""
    from app.store.migrate import head_revision, upgrade

    upgrade(database_url)
    typer.echo(f"the database is at revision {head_revision()}")


@app.command()
def verify(database_url: DatabaseUrl = _DATABASE) -> None:
    """Hash every stored run again and report damage; exit code 1 if there is any."""
    from app.store.verify import verify as verify_store

    report = verify_store(database_url)
    for damage in report.damages:
        typer.echo(str(damage), err=True)
    typer.echo(f"{report.runs} runs, {len(report.damages)} damaged")
    raise typer.Exit(0 if report.sound else 1)


@app.command()
def design(kind: str, file: Path, database_url: DatabaseUrl = _DATABASE, as_json: AsJson = False) -> None:
    """Design from a request in FILE.json; the run is stored. Exit code 3 if the request cannot be met."""
    _solve(kind, "design", _read(file), database_url, as_json)


@app.command()
def check(kind: str, file: Path, database_url: DatabaseUrl = _DATABASE, as_json: AsJson = False) -> None:
    """Check the dimensions of a request in FILE.json; the run is stored."""
    _solve(kind, "check", _read(file), database_url, as_json)


@app.command()
def demo(database_url: DatabaseUrl = _DATABASE) -> None:
    """Design the paper's flexible rod, store the run and print it."""
    from app.designs.kind import Mode
    from app.designs.registry import KINDS

    body = json.dumps(KINDS["flexible-rod"].example(Mode.DESIGN)).encode()
    _solve("flexible-rod", "design", body, database_url, as_json=False)


def _read(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        _refuse({"title": "The file cannot be read", "detail": str(error)})


def _refuse(problem: dict[str, Any]) -> None:
    typer.echo(f"{problem['title']}: {problem['detail']}", err=True)
    for item in problem.get("errors", ()):
        typer.echo(f"  {item['pointer'] or '/'}  {item['detail']} (allowed: {item['allowed']})", err=True)
    raise typer.Exit(2)


def _solve(slug: str, mode_name: str, body: bytes, database_url: str, as_json: bool) -> None:
    from app import runs
    from app.api.bodies import parse
    from app.designs.kind import Mode
    from app.designs.registry import KINDS
    from app.errors import Problem
    from app.store.migrate import upgrade
    from app.store.repository import RunStore
    from app.submission import REFUSED

    if slug not in KINDS or Mode(mode_name) not in KINDS[slug].jobs:
        _refuse({"title": "No such kind", "detail": "there are " + ", ".join(KINDS)})
    job = KINDS[slug].jobs[Mode(mode_name)]
    try:
        request = parse(job.request, body)
    except Problem as problem:
        _refuse(problem.body)
    started = time.perf_counter()
    run = runs.queued(slug, Mode(mode_name), request)
    answer = job.run(request)
    if answer.status == REFUSED:
        _refuse(answer.problem)
    run = runs.answered(run, answer, started)
    upgrade(database_url)
    with RunStore(database_url) as store:
        asyncio.run(_put(store, run))
    shown = runs.run_json(run)
    if as_json:
        typer.echo(shown.decode())
    else:
        _print_run(json.loads(shown))
    raise typer.Exit(0 if run.status == "succeeded" else 3)


async def _put(store: Any, run: Any) -> None:
    await store.put(run)


def _print_run(run: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(file=sys.stdout)
    table = Table(title=f"{run['kind']} · {run['mode']} · {run['status']}", title_justify="left", show_header=False)
    result = run["result"] or {}
    for name, value in result.items():
        if name == "dimensions":
            table.add_row("dimensions", " × ".join(f"{v:.4g}" for v in value.values()) + " mm  (b × h × l)")
        elif name == "active_constraints":
            for item in value:
                table.add_row(
                    f"active: {item['name']}", f"+1 % of it moves the objective by {item['sensitivity']:+.2f} %"
                )
        elif name == "diagnosis":
            for item in value:
                best = "nothing" if item["attainable"] is None else f"{item['attainable']:.4g}"
                table.add_row(
                    item["requirement"], f"required {item['required']:.4g}, attainable {best}; {item['advice']}"
                )
        elif isinstance(value, float):
            table.add_row(name, f"{value:.6g}")
        elif value is not None and value != []:
            table.add_row(name, str(value))
    for effect in run["effects"]:
        table.add_row(
            f"effect {effect['name']}", f"{effect['state']}, bound {effect['influence']:.2g}: {effect['why']}"
        )
    if run["accuracy"]:
        table.add_row(
            "accuracy", f"requested {run['accuracy']['requested']:g}, estimated {run['accuracy']['estimated']:.1g}"
        )
    table.add_row("time", f"{run['timing'].get('solve_s', run['timing']['total_s']):.3f} s")
    table.add_row("run", run["id"])
    console.print(table)


def main() -> None:
    """Entry point of the ``crankwright`` command."""
    app()
