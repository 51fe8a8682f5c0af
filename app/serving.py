"""The serve command: the service's process from start to shutdown.

Pages are served at once while kernels are compiled. SIGTERM or Ctrl-C stop an idle service at once, otherwise after a
drain of at most `CRANKWRIGHT_DRAIN_S` in which accepted requests are answered and stored; a second signal stops it
immediately.
"""

from __future__ import annotations

import asyncio
import gc
import json
import os
import sys
import threading
import time
from types import FrameType
from urllib.request import Request, urlopen

import typer
import uvicorn
from fastapi import FastAPI

from app.access.protection import check_protected
from app.edge.connections import ConnectionLimits, Connections
from app.jobs.fork_server import ForkServer
from app.jobs.warming import WarmupStatus, format_status
from app.main import create_app
from app.settings import Settings
from app.store.maintenance import Probe
from app.store.migrate import upgrade
from app.store.repository import RunStore

_PRINT_INTERVAL_S = 3.0
_POLL_INTERVAL_S = 0.25
_SWITCH_INTERVAL_S = 5e-4
"""How long another thread keeps the interpreter while the event loop waits for it. The loop does so after each of the
ten or so system calls of a request: at Python's default of 5 ms one busy thread delays ``/healthz`` by 50 ms."""


def run(host: str, port: int, database_url: str, fork_server: ForkServer, demo: bool = False) -> None:
    """Serve until a signal arrives. Raises StoreError and Unprotected for problems an operator can fix."""
    settings = Settings(host=host, port=port, database_url=database_url)
    prepare(settings)
    application = create_app(settings, fork_server, WarmupPrinter())
    # A telemetry collector that is down must not delay the shutdown; by default each signal takes 10 s.
    os.environ.setdefault("OTEL_EXPORTER_OTLP_TIMEOUT", "1")
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
        http=connections.protocol(), ws="none", server_header=False, access_log=False,
        proxy_headers=bool(settings.trusted_proxies), forwarded_allow_ips=settings.trusted_proxies or None,
    )  # fmt: skip
    server = _Server(config, application, demo)
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    server.run()


def prepare(settings: Settings) -> None:
    """Check before starting that the database is available and access is protected."""
    upgrade(settings.database_url)
    with RunStore(settings.database_url) as store:
        check_protected(settings, store)
        store.write_and_wait(Probe())
    if settings.open and not settings.is_local:
        typer.echo(f"CRANKWRIGHT_OPEN is set: requests to {settings.host} are served without a key", err=True)


class _Server(uvicorn.Server):
    """Prints the URLs, and announces a shutdown to the application."""

    def __init__(self, config: uvicorn.Config, application: FastAPI, demo: bool) -> None:
        super().__init__(config)
        self._application, self._demo = application, demo
        self._loop: asyncio.AbstractEventLoop | None = None
        self._told = False

    async def serve(self, sockets: list | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        await super().serve(sockets)

    async def startup(self, sockets: list | None = None) -> None:
        await super().startup(sockets)
        gc.freeze()  # permanent objects: to scan them would delay a request by a tenth of a second
        if not self.started:
            return
        port = self.servers[0].sockets[0].getsockname()[1]
        base = f"http://{self.config.host}:{port}"
        typer.echo(f"Crankwright      {base}/\nAPI reference    {base}/docs")
        if self._demo:
            threading.Thread(target=_demonstrate, args=(base,), name="demo", daemon=True).start()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        # The next signal may interrupt this handler (make and a terminal both send one), and this handler any other
        # code of the thread: waiting for a lock here could deadlock.
        if not self._told and self._loop is not None:
            self._told = True
            self._loop.call_soon_threadsafe(self._announce)
        super().handle_exit(sig, frame)

    def _announce(self) -> None:
        """Tell the application that the service is stopping, and end its solves before the drain is over."""
        service = getattr(self._application.state, "service", None)
        if service is None:  # stopped during its start
            return
        service.stopping.set()
        # Requests still waiting for a solve get a response instead of a closed connection.
        last = threading.Timer(self._application.state.settings.drain_s - 1, service.executor.close)
        last.daemon = True
        last.start()


class WarmupPrinter:
    """Prints a line of warm-up progress per kind, every few seconds."""

    def __init__(self) -> None:
        self._due: dict[str, float] = {}
        self._lock = threading.Lock()

    def __call__(self, status: WarmupStatus) -> None:
        now = time.monotonic()
        with self._lock:
            last = status.state in ("warm", "failed")
            if now < self._due.get(status.kind, 0.0) and not last:
                return
            self._due[status.kind] = now + _PRINT_INTERVAL_S
        typer.echo(f"{status.kind:16} {format_status(status)}")


def _demonstrate(base: str) -> None:
    """Request the example of a rod design from this service, wait for the run and print it."""
    from app.designs.kind import Mode
    from app.designs.registry import KINDS
    from app.printing import print_run

    body = json.dumps(KINDS["flexible-rod"].example(Mode.DESIGN)).encode()
    headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
    try:
        with urlopen(Request(f"{base}/api/v1/designs/flexible-rod", body, headers)) as answer:
            location = base + answer.headers["Location"]
        while True:
            with urlopen(location) as answer:
                run = json.loads(answer.read())
            if run["status"] not in ("queued", "running"):
                break
            time.sleep(_POLL_INTERVAL_S)
    except OSError:  # the service was stopped; the run stays stored
        return
    print_run(run)
