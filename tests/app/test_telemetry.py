"""OpenTelemetry by standard variables: spans reach a collector; an unreachable one causes no delay."""

from __future__ import annotations

import http.server
import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import opentelemetry.exporter.otlp.proto.http
import opentelemetry.sdk  # noqa: F401
import pytest

from tests.app.running import Running, wait_until

STOPS_WITHIN_S = 15.0


@pytest.fixture
def collector() -> Iterator[tuple[str, list[tuple[str, bytes]]]]:
    """A collector's address, and what it received."""
    came: list[tuple[str, bytes]] = []

    class Collect(http.server.BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            came.append((self.path, self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            return

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Collect)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", came
    server.shutdown()


def served(folder: Path, endpoint: str, monkeypatch: pytest.MonkeyPatch) -> float:
    """Request a page and stop the service; returns the seconds for stopping."""
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", endpoint)
    monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "200")
    with Running(folder, workers=1, batch_workers=0) as service, service.client() as client:
        wait_until(lambda: client.get("/healthz").status_code == 200, 170.0)
        assert client.get("/api/v1/materials").status_code == 200
        assert client.get("/static/style.css").status_code == 200
        return service.end(signal.SIGTERM)


def test_spans_reach_a_collector(tmp_path, collector, monkeypatch):
    endpoint, came = collector
    served(tmp_path, endpoint, monkeypatch)
    traces = b"".join(body for path, body in came if path == "/v1/traces")
    assert b"/api/v1/materials" in traces
    assert b"/healthz" not in traces and b"/static" not in traces
    assert "/v1/metrics" in {path for path, _ in came}


def test_an_unreachable_collector_does_not_delay_shutdown(tmp_path, monkeypatch):
    assert served(tmp_path, "http://127.0.0.1:9", monkeypatch) < STOPS_WITHIN_S
    assert os.path.exists(tmp_path / "runs.sqlite3")
