"""A service that requires keys, without workers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from starlette.testclient import TestClient

from app.access.keys import new_key
from app.access.scopes import Scope
from app.main import create_app
from app.settings import Settings
from app.store.keys import CreateKey
from app.store.record import RunRecord
from app.store.repository import RunStore
from tests.databases import sqlite_database


@dataclass
class Keyed:
    """A client, and helpers that bypass the service."""

    client: TestClient

    @property
    def store(self) -> RunStore:
        return self.client.app.state.service.store

    def warm(self) -> None:
        """Wait until requests can be solved."""
        self.client.app.state.service.executor.wait_until_warm()

    def key(self, *scopes: Scope) -> tuple[str, str]:
        """A new key and its id."""
        shown, record = new_key("of a test", scopes)
        self.store.write_and_wait(CreateKey(record, "a test"))
        return shown, record.id

    def put(self, records: Iterable[RunRecord]) -> None:
        for record in records:
            self.store.put_and_wait(record)


@contextmanager
def keyed(folder: Path, **settings: object) -> Iterator[Keyed]:
    url = sqlite_database(folder)
    app = create_app(Settings(database_url=url, workers=1, allowed_hosts="testserver", **settings))
    with TestClient(app, raise_server_exceptions=False, follow_redirects=False) as client:
        yield Keyed(client)


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}
