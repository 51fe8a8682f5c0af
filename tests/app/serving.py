"""A running application for tests: the real ASGI app with its store and its worker processes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings


@contextmanager
def serving(folder: Path, **settings: object) -> Iterator[TestClient]:
    """A client of the application on a fresh SQLite file; server errors come back as responses."""
    url = f"sqlite:///{folder}/runs.sqlite3"
    app = create_app(Settings(database_url=url, workers=1, solve_budget_s=60.0, allowed_hosts="testserver", **settings))
    with TestClient(app, raise_server_exceptions=False) as client:
        app.state.service.executor.wait_until_warm()
        yield client
