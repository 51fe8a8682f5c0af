"""A running application for tests: the real ASGI app with its store and its worker processes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings
from tests.databases import sqlite_database


@contextmanager
def serving(folder: Path, **settings: object) -> Iterator[TestClient]:
    """A client of the application on a fresh SQLite file; server errors are returned as responses."""
    url = sqlite_database(folder)
    # low-priority workers would starve beside other tests
    given = {"workers": 1, "batch_workers": 1, "batch_niceness": 0, "solve_budget_s": 60.0, "form_patience_s": 60.0}
    given |= settings
    app = create_app(Settings(database_url=url, allowed_hosts="testserver", **given))
    with TestClient(app, raise_server_exceptions=False) as client:
        app.state.service.executor.wait_until_warm()
        yield client


def file_at(client: TestClient, place: str, **more: Any) -> Any:
    """The answer with an export, however long a busy machine takes to make it."""
    end = time.monotonic() + 60
    while (answer := client.get(place, **more)).status_code == 202:
        assert time.monotonic() < end, place
        time.sleep(0.1)
    return answer
