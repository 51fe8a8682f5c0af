"""Applications loaded by `bench/service.py`: ours, ours without a database, and the usual way.

All answer a check of the flexible rod with one precomputed result, so that the service is measured, not the solver. Run
as `python -m bench.service_apps NAME PORT FOLDER`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import uvicorn
from fastapi import Depends, FastAPI
from sqlalchemy.orm import DeclarativeBase, Session, sessionmaker

from app import errors, runs
from app.api import submissions
from app.designs.flexible_rod.kind import FLEXIBLE_ROD, CheckRequest
from app.designs.kind import Mode
from app.encoded_answer import EncodedAnswer
from app.settings import Settings
from app.store import models
from app.store.engine import WRITE, make_engine
from app.store.migrate import upgrade
from app.store.record import RunRecord, StoredResponse
from app.store.repository import RunStore
from app.store.rows import RUN_FIELDS
from app.submission import Service


class ReadyAnswer:
    """An executor with precomputed answers."""

    def __init__(self) -> None:
        job = FLEXIBLE_ROD.jobs[Mode.CHECK]
        answer = job.run(job.request.model_validate(FLEXIBLE_ROD.example(Mode.CHECK)))
        self.value = EncodedAnswer.of(FLEXIBLE_ROD.slug, Mode.CHECK, answer)

    async def run(
        self, kind_slug: str, mode: str, payload: bytes, budget_s: float, report: object = None
    ) -> EncodedAnswer:
        return self.value


class NoStore:
    """A store that stores nothing."""

    async def find_answer(self, spec_hash: str, solver_name: str, solver_version: str) -> None:
        return None

    async def put(self, record: RunRecord, response: StoredResponse | None = None) -> None:
        return None


def _ours(service: Service, settings: Settings) -> FastAPI:
    app = FastAPI()
    errors.install(app, lambda _request, _problem: None)
    app.state.settings, app.state.service = settings, service
    submissions.install(app)
    return app


def durable(settings: Settings) -> FastAPI:
    """The service's routes on its own store: SQLite in WAL mode with synchronous FULL."""
    upgrade(settings.database_url)
    return _ours(Service(RunStore(settings.database_url), ReadyAnswer(), 10.0), settings)


def without_database(settings: Settings) -> FastAPI:
    """The same routes and models without storing."""
    return _ours(Service(NoStore(), ReadyAnswer(), 10.0), settings)


class Base(DeclarativeBase):
    """Tables of the usual way."""

    metadata = models.metadata


class Run(Base):
    """The run as a mapped class over the same table."""

    __table__ = models.runs


def orm_in_threads(settings: Settings) -> FastAPI:
    """The usual way: a sync endpoint in the thread pool, one ORM session and one commit a request, the same FULL."""
    upgrade(settings.database_url)
    engine = make_engine(settings.database_url).execution_options(**WRITE)
    sessions = sessionmaker(engine, expire_on_commit=False)
    ready = ReadyAnswer().value

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        engine.dispose()

    app = FastAPI(lifespan=lifespan)

    def session() -> Iterator[Session]:
        with sessions() as opened:
            yield opened

    def submit(request: CheckRequest, opened: Session = Depends(session)) -> dict:  # noqa: B008
        run = runs.answered(runs.queued("flexible-rod", "check", request), ready, 0.0)
        row = {name: getattr(run, name) for name in RUN_FIELDS} | {"source_run_ids": None}
        opened.add(Run(**row, row_hash="0" * 64))
        opened.commit()
        return json.loads(runs.run_json(run))

    app.add_api_route("/api/v1/checks/flexible-rod", submit, methods=["POST"], status_code=201)
    return app


APPS: dict[str, Callable[[Settings], FastAPI]] = {
    make.__name__: make for make in (durable, without_database, orm_in_threads)
}


def main(name: str, port: str, folder: str) -> None:
    """Serve one of the applications."""
    settings = Settings(database_url=f"sqlite:///{Path(folder) / name}.sqlite3")
    uvicorn.run(APPS[name](settings), port=int(port), log_level="error", access_log=False)


if __name__ == "__main__":
    main(*sys.argv[1:])
