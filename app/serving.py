"""The service in this process: from its command to its end.

Pages are served at once; kernels are compiled meanwhile. SIGTERM or Ctrl-C end it at once when it is idle, else after a
drain of `CRANKWRIGHT_DRAIN_S` at most, in which accepted requests are answered and stored; a second ends it at once.
"""

from __future__ import annotations

import json
import os
import threading
import time
from types import FrameType
from urllib.request import Request, urlopen

import typer
import uvicorn
from fastapi import FastAPI

from app.access.protection import check_protected
from app.edge.connections import ConnectionLimits, Connections
from app.jobs.template import Template
from app.jobs.warming import Warmth, in_words
from app.main import create_app
from app.settings import Settings
from app.store.migrate import upgrade
from app.store.repository import RunStore
from app.store.upkeep import Probe

_BETWEEN_LINES_S = 3.0
_BETWEEN_LOOKS_S = 0.25


def run(host: str, port: int, database_url: str, template: Template, demo: bool = False) -> None:
    """Serve until a signal comes. Raises StoreError and Unprotected for what an operator can mend."""
    settings = Settings(host=host, port=port, database_url=database_url)
    prepare(settings)
    # What is left for a collector that is away must not hold up the service's end; by default each signal takes 10 s.
    os.environ.setdefault("OTEL_EXPORTER_OTLP_TIMEOUT", "1")
    application = create_app(settings, template, Teller())
    connections = Connections(
        ConnectionLimits(
            settings.max_connections,
            settings.max_connections_of_one,
            settings.head_timeout_s,
            settings.max_head_bytes,
            settings.unread_timeout_s,
        )
    )
    config = uvicorn.Config(
        application, host=host, port=port, log_config=None, timeout_graceful_shutdown=settings.drain_s, lifespan="on",
        http=connections.protocol(), ws="none", server_header=False,
        proxy_headers=bool(settings.trusted_proxies), forwarded_allow_ips=settings.trusted_proxies or None,
    )  # fmt: skip
    server = _Server(config, application, demo)
    server.run()


def prepare(settings: Settings) -> None:
    """See to it that a start will not fail for its surroundings: the database is there and protected."""
    upgrade(settings.database_url)
    with RunStore(settings.database_url) as store:
        check_protected(settings, store)
        store.write_and_wait(Probe())
    if settings.open and not settings.is_local:
        typer.echo(f"CRANKWRIGHT_OPEN is set: everybody who reaches {settings.host} is served, without a key", err=True)


class _Server(uvicorn.Server):
    """Says where it serves, and tells the application when it is asked to stop."""

    def __init__(self, config: uvicorn.Config, application: FastAPI, demo: bool) -> None:
        super().__init__(config)
        self._application, self._demo = application, demo

    async def startup(self, sockets: list | None = None) -> None:
        await super().startup(sockets)
        if not self.started:
            return
        port = self.servers[0].sockets[0].getsockname()[1]
        base = f"http://{self.config.host}:{port}"
        typer.echo(f"Crankwright      {base}/\nAPI reference    {base}/docs")
        if self._demo:
            threading.Thread(target=_demonstrate, args=(base,), name="demo", daemon=True).start()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        service = self._application.state.service
        if not service.stopping.is_set():
            service.stopping.set()
            # What waits for a solve until then is told so, rather than cut off.
            last = threading.Timer(self._application.state.settings.drain_s - 1, service.executor.close)
            last.daemon = True
            last.start()
        super().handle_exit(sig, frame)


class Teller:
    """One line of progress in the terminal for each kind whose kernels are compiled, every few seconds."""

    def __init__(self) -> None:
        self._due: dict[str, float] = {}
        self._lock = threading.Lock()

    def __call__(self, warmth: Warmth) -> None:
        now = time.monotonic()
        with self._lock:
            last = warmth.state in ("warm", "failed")
            if now < self._due.get(warmth.kind, 0.0) and not last:
                return
            self._due[warmth.kind] = now + _BETWEEN_LINES_S
        typer.echo(in_words(warmth))


def _demonstrate(base: str) -> None:
    """Ask this very service for the example of a rod's design, wait for the run and print it."""
    from app.designs.kind import Mode
    from app.designs.registry import KINDS
    from app.printing import print_run

    body = json.dumps(KINDS["flexible-rod"].example(Mode.DESIGN)).encode()
    headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
    try:
        with urlopen(Request(f"{base}/api/v1/designs/flexible-rod", body, headers)) as answer:
            place = base + answer.headers["Location"]
        while True:
            with urlopen(place) as answer:
                run = json.loads(answer.read())
            if run["status"] not in ("queued", "running"):
                break
            time.sleep(_BETWEEN_LOOKS_S)
    except OSError:  # the service was stopped meanwhile; the run is kept
        return
    print_run(run)
