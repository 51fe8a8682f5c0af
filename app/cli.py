"""The command line."""

from __future__ import annotations

import json
import os
import sys
import time
from codecs import BOM_UTF8
from pathlib import Path
from typing import Annotated, Any

import typer

from app import operators
from app.importing import gc_paused
from app.operators import DATABASE, DatabaseUrl

app = typer.Typer(
    name="crankwright",
    help="Design optimization for crank mechanisms. CRANKWRIGHT_* variables set the same things as the options.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    # Rich help would import a library larger than everything else.
    rich_markup_mode=None,
)

app.add_typer(operators.keys)
for _command in (operators.audit, operators.backup, operators.restore, operators.prune):
    app.command()(_command)

AsJson = Annotated[bool, typer.Option("--json", help="print the run as JSON")]
_PRELOAD = "app.jobs.preload"


@app.command()
def serve(
    host: Annotated[str, typer.Option(envvar="CRANKWRIGHT_HOST")] = "127.0.0.1",
    port: Annotated[int, typer.Option(envvar="CRANKWRIGHT_PORT", min=0, max=65535)] = 8000,
    database_url: DatabaseUrl = DATABASE,
    demo: Annotated[bool, typer.Option("--demo", help="design the paper's flexible rod at start-up")] = False,
) -> None:
    """Migrate the database and serve the API and the pages."""
    import signal

    from app.jobs.fork_server import ForkServer

    # Until there is work to finish, Ctrl-C ends this process like any other signal.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    fork_server = ForkServer(_PRELOAD)
    fork_server.start()
    with gc_paused():
        from app.serving import run

    run(host, port, database_url, fork_server, demo)


@app.command()
def migrate(database_url: DatabaseUrl = DATABASE) -> None:
    """Bring the database to this version's schema."""
    from app.store.migrate import latest_revision, upgrade

    upgrade(database_url)
    typer.echo(f"the database is at revision {latest_revision()}")


@app.command("warm-up")
def warm_up() -> None:
    """Compile all numerical kernels for this machine and cache them on disk; quick if already done."""
    from app.jobs.fork_server import ForkServer
    from app.jobs.warming import KernelWarming
    from app.serving import WarmupPrinter

    _configure_log()
    started = time.perf_counter()
    fork_server = ForkServer(_PRELOAD)
    warming = KernelWarming(fork_server, WarmupPrinter())
    try:
        fork_server.start()
        warming.start()
        warming.wait()
    finally:
        warming.close()
        fork_server.close()
    typer.echo(f"warm after {time.perf_counter() - started:.0f} s")
    raise typer.Exit(1 if warming.failed else 0)


@app.command()
def verify(database_url: DatabaseUrl = DATABASE) -> None:
    """Verify the hash of every stored run and report damage; exit code 1 if there is any."""
    from app.store.verify import verify as verify_store

    report = verify_store(database_url)
    if report.older:
        typer.echo(f"the database is at revision {report.older} of an earlier version: crankwright migrate", err=True)
        raise typer.Exit(1)
    for damage in report.damages:
        typer.echo(str(damage), err=True)
    damaged = {(damage.table, damage.key) for damage in report.damages}
    items = f"{report.batch_items} items of batches, " if report.batch_items else ""
    typer.echo(f"{report.runs} runs, {items}{len(damaged)} damaged")
    raise typer.Exit(0 if report.sound else 1)


@app.command()
def design(kind: str, file: Path, database_url: DatabaseUrl = DATABASE, as_json: AsJson = False) -> None:
    """Design from the request in FILE.json and store the run. Exit code 3 if no design exists, 4 if the design found
    fails a criterion."""
    _solve(kind, "design", _read(file), database_url, as_json)


@app.command()
def check(kind: str, file: Path, database_url: DatabaseUrl = DATABASE, as_json: AsJson = False) -> None:
    """Check the dimensions in FILE.json and store the run. Exit code 4 if a criterion fails."""
    _solve(kind, "check", _read(file), database_url, as_json)


@app.command()
def analyse(kind: str, file: Path, database_url: DatabaseUrl = DATABASE, as_json: AsJson = False) -> None:
    """Analyse the crank dynamics or masses described in FILE.json and store the run."""
    _solve(kind, "analysis", _read(file), database_url, as_json)


@app.command()
def accuracy(kind: str, file: Path, database_url: DatabaseUrl = DATABASE, as_json: AsJson = False) -> None:
    """Measure the cost of accuracy for the request in FILE.json and store the run."""
    try:
        spec = json.loads(_read(file))
    except ValueError as error:
        _refuse({"title": "The request is not valid", "detail": str(error)})
    body = spec if isinstance(spec, dict) and "spec" in spec else {"spec": spec}
    _solve(kind, "accuracy", json.dumps(body).encode(), database_url, as_json)


@app.command()
def worker(
    cluster: Annotated[str, typer.Option(envvar="CRANKWRIGHT_CLUSTER", help="the scheduler: tcp://host:8786")],
    workers: Annotated[int, typer.Option(envvar="CRANKWRIGHT_BATCH_WORKERS", min=1, max=256)] = 2,
) -> None:
    """Solve batch chunks for a Dask scheduler until stopped. Needs the extra [cluster]."""
    import asyncio

    from app.batches.workers import chunk_workers
    from app.jobs.cluster import run_worker
    from app.settings import Settings

    _configure_log()
    try:
        asyncio.run(run_worker(cluster, chunk_workers(Settings(batch_workers=workers))))
    except ImportError:
        _refuse({"title": "No cluster", "detail": "install crankwright[cluster] for this"})
    except KeyboardInterrupt:
        typer.echo("stopped", err=True)


@app.command()
def report(
    run_id: str,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="a .pdf or .html; default: RUN_ID.pdf")] = None,
    database_url: DatabaseUrl = DATABASE,
) -> None:
    """Write the report of a stored run: verdict, drawing, hand calculation, certificate, plots."""
    import asyncio

    from app import runs
    from app.designs.registry import KINDS
    from app.exports.export import ExportOptions
    from app.exports.report import HTML, PDF
    from app.item_tables import lacks_tables
    from app.store.engine import check_exists
    from app.store.errors import UnknownRun
    from app.store.migrate import upgrade
    from app.store.repository import RunStore

    file = output or Path(f"{run_id}.pdf")
    exports = {".pdf": PDF, ".html": HTML}
    if file.suffix.lower() not in exports:
        _refuse({"title": "Unknown report format", "detail": "the file name must end in " + " or ".join(exports)})
    check_exists(database_url)
    upgrade(database_url)
    with RunStore(database_url) as store:
        try:
            record = asyncio.run(store.get(run_id))
        except UnknownRun:
            _refuse({"title": "No such run", "detail": f"no run has the id {run_id}"})
    if record.result is None or record.kind not in KINDS:
        _refuse({"title": "Nothing to report", "detail": f"the run is {record.status}: it has no result"})
    run = json.loads(runs.run_json(_with_tables(record) if lacks_tables(record) else record))
    made = exports[file.suffix.lower()].file(KINDS[run["kind"]], run, ExportOptions())
    try:
        file.write_bytes(made.content)
    except OSError as error:
        _refuse({"title": "The file cannot be written", "detail": str(error)})
    typer.echo(str(file))


def _with_tables(record: Any) -> Any:
    """A batch item with its curves and tables, which are solved again."""
    from dataclasses import replace

    from app.encoded_answer import EncodedAnswer
    from app.item_tables import job_of_run, with_tables
    from app.jobs.errors import BudgetExceeded
    from app.printing import shown_progress

    job = job_of_run(record)
    request = job.request.model_validate_json(record.spec)
    try:
        with shown_progress() as progress:
            answer = _answer(job, record, request, progress)
    except BudgetExceeded as error:
        _refuse({"title": "Nothing to report", "detail": f"the item was stored without its curves: {error}"})
    result = with_tables(record, EncodedAnswer.of(record.kind, record.mode, answer).decoded())
    if result is None:
        why = "the item was stored without its curves, and solved again it has other numbers"
        _refuse({"title": "Nothing to report", "detail": why})
    return replace(record, result=result)


@app.command()
def batch(
    kind: str,
    mode: str,
    cases: Path,
    output: Annotated[Path, typer.Option("--output", "-o", help="file for the results: .csv, .ndjson or .parquet")],
    url: Annotated[
        str, typer.Option(envvar="CRANKWRIGHT_URL", help="URL of a running service; default: solve locally")
    ] = "",
    api_key: Annotated[str, typer.Option(envvar="CRANKWRIGHT_API_KEY", help="API key of that service")] = "",
    full: Annotated[bool, typer.Option("--full", help="store curves and tables too")] = False,
    workers: Annotated[int, typer.Option(min=1, max=256, help="worker processes for solving locally")] = 2,
    database_url: DatabaseUrl = DATABASE,
) -> None:
    """Design, check or analyse every row of CASES (.csv, .ndjson, .parquet, or a sweep in .json). Repeating the command
    resumes an interrupted batch, and starts a new one after a cancelled one. Exit code 5 if any row was refused, failed
    or was cancelled."""
    import asyncio
    from http.client import HTTPException

    from app.batches.case_files import check_files
    from app.batches.offline import here
    from app.batches.remote import check_service, there
    from app.errors import Problem
    from app.printing import shown_batch

    _configure_log()
    api_key, detail = api_key.strip(), "full" if full else "scalars"
    try:
        check_files(cases, output)
        if url:
            check_service(url, api_key)
        with shown_batch() as told:
            if url:
                ended = there(url, api_key or None, cases, kind, mode, detail, output, told)
            else:
                ended = asyncio.run(here(cases, kind, mode, detail, output, database_url, workers, told))
    except Problem as problem:
        _refuse(problem.body)
    except (OSError, HTTPException) as error:
        typer.echo(
            f"The batch is not complete: {getattr(error, 'reason', error)}; repeat the command to resume", err=True
        )
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        typer.echo("stopped; repeat the command to resume", err=True)
        raise typer.Exit(130) from None
    items = ended["items"]
    counted = ", ".join(f"{items[name]} {name}" for name in items if items[name] and name not in ("total", "done"))
    typer.echo(f"{items['total']} items: {counted}; results in {output}")
    if items["cancelled"]:
        typer.echo("The batch was cancelled; repeat the command to solve all rows in a new one", err=True)
    raise typer.Exit(5 if items["refused"] or items["failed"] or items["cancelled"] else 0)


@app.command()
def demo(database_url: DatabaseUrl = DATABASE) -> None:
    """Design the paper's flexible rod, store the run and print it."""
    from app.designs.kind import Mode
    from app.designs.registry import KINDS

    body = json.dumps(KINDS["flexible-rod"].example(Mode.DESIGN)).encode()
    _solve("flexible-rod", "design", body, database_url, as_json=False)


def _configure_log() -> None:
    """Log as the settings say, for commands that do more than solve in this process."""
    from app.logging import configure
    from app.settings import Settings

    settings = Settings()
    configure(settings.log_format, settings.log_level)


def _read(file: Path) -> bytes:
    """The content of a file, without the byte order mark that editors of Windows begin it with."""
    try:
        return file.read_bytes().removeprefix(BOM_UTF8)
    except OSError as error:
        _refuse({"title": "The file cannot be read", "detail": str(error)})


def _refuse(problem: dict[str, Any]) -> None:
    typer.echo(f"{problem['title']}: {problem['detail']}", err=True)
    for item in problem.get("errors", ()):
        typer.echo(f"  {item['pointer'] or '/'}  {item['detail']} (allowed: {item['allowed']})", err=True)
    raise typer.Exit(2)


def _solve(slug: str, mode_name: str, body: bytes, database_url: str, as_json: bool) -> None:
    with gc_paused():
        import asyncio

        from app import runs
        from app.api.bodies import parse
        from app.designs.kind import REFUSED, Mode
        from app.designs.problems import OUT_OF_TIME
        from app.designs.registry import KINDS, job_of, modes_of
        from app.encoded_answer import EncodedAnswer
        from app.errors import Problem
        from app.jobs.errors import BudgetExceeded
        from app.printing import print_run, shown_progress
        from app.run_references import resolve_references
        from app.store.migrate import upgrade
        from app.store.repository import RunStore

        mode = Mode(mode_name)
        if slug not in KINDS or mode not in modes_of(KINDS[slug]):
            known = [name for name, kind in KINDS.items() if mode in modes_of(kind)]
            _refuse({"title": "No such kind", "detail": "there are " + ", ".join(known)})
        job = job_of(KINDS[slug], mode)
    try:
        request = parse(job.request, body)
    except Problem as problem:
        _refuse(problem.body)
    started = time.perf_counter()
    upgrade(database_url)
    with RunStore(database_url) as store:
        try:
            request = asyncio.run(resolve_references(store, request))
        except Problem as problem:
            _refuse(problem.body)
        run = runs.queued(slug, mode, request)
        try:
            with shown_progress() as report:
                answer = _answer(job, run, request, report)
        except BudgetExceeded as error:
            run = runs.failed(run, 504, OUT_OF_TIME, str(error), started)
        else:
            if answer.status == REFUSED:
                _refuse(answer.problem)
            run = runs.answered(run, EncodedAnswer.of(slug, mode, answer), started)
        store.put_and_wait(run)
    shown = runs.run_json(run)
    if as_json:
        typer.echo(shown.decode())
    else:
        print_run(json.loads(shown))
    raise typer.Exit(3 if run.status != "succeeded" else 4 if run.holds is False else 0)


def _answer(job: Any, run: Any, request: Any, report: Any) -> Any:
    """Solve in this process; a design with a time budget whose solver does not look at the clock, in a process that can
    be killed."""
    from app.designs.schema import time_budget_of

    asked = time_budget_of(request)
    if asked is None or job.best_in_time:
        return job.solve(request, report)

    import asyncio

    from app.jobs.executor import PoolSettings, ProcessPool

    _configure_log()
    pool = ProcessPool(PoolSettings(workers=1, kernels=False))
    pool.start()
    try:
        return asyncio.run(pool.run(run.kind, run.mode, request.model_dump_json().encode(), asked, report)).decoded()
    finally:
        pool.close()


def main() -> None:
    """Entry point of the ``crankwright`` command; errors an operator can fix are printed in one line."""
    from app.invalid_settings import InvalidSettings
    from app.store.errors import StoreError

    try:
        app()
    except (StoreError, InvalidSettings) as error:
        typer.echo(str(error), err=True)
        sys.exit(1)
    except OSError as error:
        # What standard output still holds would fail again at the end of the process.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        typer.echo(str(error), err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
