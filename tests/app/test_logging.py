"""Logging: one format for all records, and tracebacks of unexpected errors."""

from __future__ import annotations

import asyncio
import io
import json
import logging
from collections.abc import Iterator

import pytest

from app.api.bodies import parse
from app.designs.kind import Answer, Mode
from app.designs.registry import KINDS
from app.jobs.errors import SolveFailed, WorkerCrashed
from app.logging import LogFormat, LogLevel, configure, get_logger
from app.store.repository import RunStore
from app.submission import Service
from tests.databases import sqlite_database

ROD = KINDS["flexible-rod"]


@pytest.fixture
def log() -> Iterator[io.StringIO]:
    """Log records during a test, as JSON lines."""
    stream, root = io.StringIO(), logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    configure(LogFormat.JSON, LogLevel.INFO, stream)
    yield stream
    root.handlers[:] = handlers
    root.setLevel(level)


def records(stream: io.StringIO) -> list[dict]:
    return [json.loads(line) for line in stream.getvalue().splitlines()]


def test_both_logging_libraries_have_one_format(log):
    get_logger("app.here").info("began", run_id="r1")
    logging.getLogger("another.package").warning("it is %s", "late")
    own, foreign = records(log)
    assert (own["logger"], own["level"], own["event"], own["run_id"]) == ("app.here", "info", "began", "r1")
    assert (foreign["logger"], foreign["level"], foreign["event"]) == ("another.package", "warning", "it is late")
    assert own.keys() - {"run_id"} == foreign.keys()


def test_records_below_the_level_are_dropped(log):
    get_logger("app.here").debug("no")
    logging.getLogger("another.package").debug("no")
    assert records(log) == []


@pytest.mark.parametrize("form", LogFormat)
def test_an_exception_is_written_with_its_traceback(log, form):
    stream = io.StringIO()
    configure(form, LogLevel.INFO, stream)
    try:
        raise ZeroDivisionError("the reason")
    except ZeroDivisionError:
        get_logger("app.here").exception("went_wrong")
    assert "Traceback" in stream.getvalue() and "ZeroDivisionError: the reason" in stream.getvalue()
    assert log.getvalue() == "", "a second configuration replaces the first"


class Failing:
    """An executor whose solves all end the same way."""

    def is_warm(self, *_: str) -> bool:
        return True

    def __init__(self, error: Exception) -> None:
        self._error = error

    def start(self) -> None: ...

    async def run(self, *_given: object) -> Answer:
        raise self._error

    def close(self) -> None: ...


@pytest.fixture
def store(tmp_path) -> Iterator[RunStore]:
    with RunStore(sqlite_database(tmp_path)) as opened:
        yield opened


def request_of(body: dict):
    return parse(ROD.jobs[Mode.CHECK].request, json.dumps(body).encode())


def test_the_traceback_of_a_failed_solve_is_only_logged(store, log, check_request):
    service = Service(store, Failing(SolveFailed("ValueError", "Traceback: line 7, ValueError: secret")), 10.0)
    run = asyncio.run(service.answer(ROD, Mode.CHECK, request_of(check_request)))
    (told,) = records(log)
    assert told["event"] == "solve_failed" and told["exception"] == "Traceback: line 7, ValueError: secret"
    assert (told["run_id"], told["kind"], told["mode"]) == (run.id, "flexible-rod", "check")
    assert run.status == "failed" and b"secret" not in run.problem


def test_a_crashed_worker_is_logged(store, log, check_request):
    asyncio.run(Service(store, Failing(WorkerCrashed(9)), 10.0).answer(ROD, Mode.CHECK, request_of(check_request)))
    (told,) = records(log)
    assert told["event"] == "worker_crashed" and "code 9" in told["reason"]


def test_unexpected_background_errors_are_logged(store, log, check_request):
    service = Service(store, Failing(RuntimeError("secret")), 10.0)

    async def later():
        response = await service.submit_later(ROD, Mode.CHECK, request_of(check_request), None, "")
        await asyncio.gather(*service.accepted_runs.solves.values())
        return await store.get(response.run_id)

    run = asyncio.run(later())
    (told,) = records(log)
    assert told["event"] == "background_solve_failed" and told["run_id"] == run.id
    assert "RuntimeError: secret" in told["exception"]
    assert run.status == "failed" and b"secret" not in run.problem
