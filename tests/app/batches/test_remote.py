"""Command-line batches on a service that is busy, restarts, stops or refuses."""

from __future__ import annotations

import errno
import json
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from click.testing import Result
from typer.testing import CliRunner

from app.batches import remote
from app.cli import app
from app.designs.kind import Mode
from app.designs.registry import KINDS

runner = CliRunner()
PIN = KINDS["pin-profile"].example(Mode.CHECK)
Answer = tuple[int, dict[str, str], Any]


class Service:
    """A service that returns answers in turn, the last for ever, and records requests: their methods, idempotency keys
    and bodies."""

    def __init__(self) -> None:
        self.answers: list[Answer] = []
        self.asked: list[tuple[str, str | None, bytes]] = []
        self.url = ""

    def next(self, method: str, key: str | None, body: bytes) -> Answer:
        self.asked.append((method, key, body))
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]


@pytest.fixture
def service() -> Iterator[Service]:
    played = Service()

    class Handler(BaseHTTPRequestHandler):
        def answer(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            status, headers, content = played.next(self.command, self.headers["Idempotency-Key"], body)
            if not status:
                return  # closes the connection
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(json.dumps(content).encode())

        do_GET = do_POST = answer

        def log_message(self, *_args: object) -> None:
            """Quiet."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        played.url = f"http://127.0.0.1:{server.server_port}"
        yield played
        server.shutdown()


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The pauses that the command would have made."""
    made: list[float] = []
    monkeypatch.setattr(remote.time, "sleep", made.append)
    return made


@pytest.fixture
def send(tmp_path: Path) -> Callable[..., Result]:
    cases = tmp_path / "cases.ndjson"
    cases.write_text(json.dumps(PIN))

    def call(url: str, key: str = "") -> Result:
        command = ["batch", "pin-profile", "check", str(cases), "-o", str(tmp_path / "results.csv")]
        return runner.invoke(app, [*command, "--url", url, "--api-key", key])

    return call


def batch(status: str, number: str = "1", **items: int) -> Answer:
    counted = {"total": 1, "done": 0, "succeeded": 0, "refused": 0, "failed": 0, "cancelled": 0} | items
    links = {"self": f"/api/v1/batches/{number}", "results": f"/api/v1/batches/{number}/results"}
    return 200, {}, {"id": number, "status": status, "items": counted, "links": links}


BUSY = (429, {"Retry-After": "7"}, {"title": "Too many requests", "detail": "too many"})
AWAY = (0, {}, None)
SOLVED = batch("ended", done=1, succeeded=1)
RESULTS = (200, {}, "index")
CUT = (200, {"Transfer-Encoding": "chunked"}, "index")
"""Results that end before the first chunk does."""


def test_a_busy_service_is_waited_for(service: Service, pauses: list[float], send: Callable[..., Result]) -> None:
    service.answers = [BUSY, batch("queued"), BUSY, batch("running"), (503, {}, None), SOLVED, BUSY, RESULTS]
    answer = send(service.url)
    assert answer.exit_code == 0, answer.output
    assert pauses == [7.0, 7.0, remote._FIRST_POLL_S, remote._RETRY_S, 7.0]
    # The rows are sent whole each time, under one key.
    first, again = service.asked[:2]
    assert first == again and json.loads(first[2]) == PIN and first[1]


def test_a_restart_is_waited_for(
    service: Service, pauses: list[float], send: Callable[..., Result], tmp_path: Path
) -> None:
    service.answers = [batch("queued"), AWAY, batch("running"), AWAY, AWAY, SOLVED, AWAY, CUT, RESULTS]
    answer = send(service.url)
    assert answer.exit_code == 0, answer.output
    assert pauses.count(remote._RETRY_S) == 5
    assert (tmp_path / "results.csv").read_text() == '"index"' and not list(tmp_path.glob("*.part"))


def test_a_full_disk_is_not_waited_for(
    service: Service, pauses: list[float], send: Callable[..., Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_given: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(remote, "replacing", full)
    service.answers = [SOLVED, SOLVED, RESULTS]
    answer = send(service.url)
    assert (answer.exit_code, pauses) == (1, []) and "No space left on device" in answer.stderr


def test_a_long_batch_is_looked_at_less_often(
    service: Service, pauses: list[float], send: Callable[..., Result]
) -> None:
    service.answers = [batch("queued"), *20 * [batch("running")], SOLVED, RESULTS]
    assert send(service.url).exit_code == 0
    assert pauses[0] == 0.5 and max(pauses) == pauses[-1] == 5.0


@pytest.mark.parametrize("answers", [[BUSY], [batch("queued"), BUSY], [batch("queued"), AWAY]])
def test_patience_ends_with_a_hint(
    service: Service, pauses: list[float], send: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, answers: Any
) -> None:
    monkeypatch.setattr(remote, "_PATIENCE_S", 0.0)
    service.answers = answers
    answer = send(service.url)
    assert (answer.exit_code, pauses) == (1, [])
    assert answer.stderr.startswith("The batch is not complete: ") and "repeat the command to resume" in answer.stderr


def test_a_stopped_service_is_not_waited_for_without_end(
    service: Service, send: Callable[..., Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(remote, "_ROWS_TIMEOUT_S", 0.2)
    monkeypatch.setattr(Service, "next", lambda *_given: (time.sleep(1.0), AWAY)[1])
    answer = send(service.url)
    assert answer.exit_code == 1 and "The batch is not complete: timed out" in answer.stderr


def test_a_refusal_is_told(service: Service, send: Callable[..., Result]) -> None:
    found = {"pointer": "/kind", "detail": "is no kind", "allowed": "pin-profile"}
    service.answers = [(422, {}, {"title": "Not valid", "detail": "no", "errors": [found]})]
    answer = send(service.url)
    assert answer.exit_code == 2
    assert answer.stderr.splitlines() == ["Not valid: no", "  /kind  is no kind (allowed: pin-profile)"]
    service.answers = [(418, {}, ["a teapot"])]
    answer = send(service.url)
    assert answer.exit_code == 2 and "The service refused: HTTP status 418" in answer.stderr


def test_a_batch_cancelled_before_is_not_resumed(service: Service, send: Callable[..., Result]) -> None:
    cancelled, resumed = batch("cancelled", cancelled=1), batch("ended", "2", done=1, succeeded=1)
    service.answers = [batch("queued"), cancelled, batch("queued", "2"), resumed, RESULTS]
    answer = send(service.url)
    assert answer.exit_code == 0 and "1 items: 1 succeeded" in answer.stdout, answer.output
    keys = [key for method, key, _ in service.asked if method == "POST"]
    assert keys == [keys[0], f"{keys[0]}-2"]


def test_a_batch_cancelled_meanwhile_is_told(
    service: Service, pauses: list[float], send: Callable[..., Result]
) -> None:
    service.answers = [batch("queued"), batch("running"), batch("cancelled", cancelled=1), RESULTS]
    answer = send(service.url)
    assert answer.exit_code == 5 and "1 items: 1 cancelled" in answer.stdout
    assert answer.stderr == "The batch was cancelled; repeat the command to solve all rows in a new one\n"


@pytest.mark.parametrize(
    ("url", "key", "code", "told"),
    [
        ("http://127.0.0.1:9", "cw_secret\n", 1, "The batch is not complete: [Errno 111]"),
        ("http://127.0.0.1:9", "cw_\x01secret", 2, "No API key: the key has characters that no key has"),
        ("127.0.0.1:9", "", 2, "No service: '127.0.0.1:9' is no address"),
        ("http://127.0.0.1:port", "", 2, "No service: 'http://127.0.0.1:port' is no address"),
        ("http://", "", 2, "No service: 'http://' is no address"),
        ("http://localhost:9/ü", "", 2, "No service: 'http://localhost:9/ü' is no address: allowed is one of ASCII"),
        ("http://bü..cher.example", "", 2, "No service: 'http://bü..cher.example' is no address"),
        ("http://a..example", "", 2, "No service: 'http://a..example' is no address"),
        ("http://user:secret@localhost:99999", "", 2, "No service: 'localhost:99999' is no address"),
        ("http://user:secret@localhost:9", "", 2, "No service: 'localhost:9' is no address"),
    ],
)
def test_the_service_and_its_key_are_checked(
    send: Callable[..., Result], url: str, key: str, code: int, told: str
) -> None:
    answer = send(url, key)
    assert answer.exit_code == code and told in answer.stderr and "secret" not in answer.stderr
