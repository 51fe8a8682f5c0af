"""Shared fixtures."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy.engine import make_url
from starlette.testclient import TestClient

from app.designs.kind import Mode
from app.designs.registry import KINDS
from app.store.migrate import upgrade
from tests.app.serving import serving
from tests.databases import fresh_database, postgres_server, sqlite_database

# Modules and tests live as long as the process: to collect garbage among them takes a tenth of its time. They are left
# out of later collections, which are made less often: a test allocates more than a process is expected to.
gc.disable()
_ALLOCATIONS_BETWEEN_COLLECTIONS = 10_000


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.set_threshold(_ALLOCATIONS_BETWEEN_COLLECTIONS)
    gc.enable()


@pytest.fixture(scope="session")
def postgres_server_url() -> Iterator[str]:
    with postgres_server() as url:
        yield url


@pytest.fixture(scope="session")
def postgres_template(postgres_server_url: str) -> Iterator[str]:
    """The name of a migrated database that has no connections, to be copied."""
    with fresh_database(postgres_server_url) as url:
        upgrade(url)
        yield make_url(url).database or ""


@pytest.fixture(params=["sqlite", "postgresql"])
def empty_database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """A database without any table: an SQLite file, then a real PostgreSQL database."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path}/runs.sqlite3"
        return
    with fresh_database(request.getfixturevalue("postgres_server_url")) as url:
        yield url


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """The same, migrated."""
    if request.param == "sqlite":
        yield sqlite_database(tmp_path)
        return
    server, template = map(request.getfixturevalue, ("postgres_server_url", "postgres_template"))
    with fresh_database(server, template) as url:
        yield url


@pytest.fixture(scope="session")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with serving(tmp_path_factory.mktemp("service")) as running:
        yield running


@pytest.fixture
def check_request() -> dict:
    return KINDS["flexible-rod"].example(Mode.CHECK)


@pytest.fixture
def design_request() -> dict:
    return KINDS["flexible-rod"].example(Mode.DESIGN)
