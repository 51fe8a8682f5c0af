"""The service: settings in, ASGI application out."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import Depends, FastAPI
from fastapi.middleware.gzip import GZipMiddleware
from fastapi.staticfiles import StaticFiles
from prometheus_fastapi_instrumentator import Instrumentator

from app import errors, metrics
from app.access.forgery import check_forgery
from app.access.gate import Gate
from app.access.keys import KeyRing
from app.access.protection import check_protected
from app.access.quotas import Quotas
from app.access.sessions import Sessions
from app.api import batches, catalogue, contract, exports, operation, runs, submissions
from app.api.heads import Heads
from app.batches import chunk
from app.batches.service import BatchService
from app.downloads import Downloads
from app.edge.asgi import Application, Scope
from app.edge.crowds import ALWAYS
from app.edge.stack import GuardedFastAPI, edge
from app.jobs.executor import PoolSettings, ProcessPool
from app.jobs.template import Template
from app.jobs.turns import TurnLimits, Turns
from app.jobs.warming import Told, tell_nobody
from app.logging import configure, get_logger
from app.settings import Settings
from app.store.errors import StoreError
from app.store.migrate import upgrade
from app.store.repository import RunStore
from app.submission import InTurn, Service, ServiceLimits
from app.version import VERSION
from app.web import actions, batch_pages, form_pages, login, pages, reference, run_pages, worth
from app.web.languages import Speaking
from app.web.problems import problem_page
from app.web.rendering import STATIC

logger = get_logger(__name__)


def untold(scope: Scope) -> bool:
    """Whether a request is left out of traces: files of the pages, and what asks how the service is."""
    return scope["path"] in ALWAYS or scope["path"].startswith("/static/")


_DAY_S = 24 * 3600.0


async def expire_daily(store: RunStore) -> None:
    """Take out idempotency keys that are good no longer, at the start and every day."""
    while True:
        try:
            await store.expire_keys()
        except StoreError as error:
            logger.error("keys_not_expired", reason=str(error))
        await asyncio.sleep(_DAY_S)


def _pool(settings: Settings, template: Template | None, told: Told) -> ProcessPool:
    """Workers for people, and behind them workers for batches, on this machine or on a cluster."""
    behind = PoolSettings(
        workers=settings.workers,
        memory_bytes=settings.solve_memory_bytes,
        told=told,
        background_workers=0 if settings.cluster else settings.batch_workers,
        background_entry=chunk.answer,
        background_niceness=settings.batch_niceness,
    )
    if not settings.cluster:
        return ProcessPool(behind, template)
    from app.jobs.cluster import ClusterPool

    there = PoolSettings(
        workers=0,
        memory_bytes=settings.solve_memory_bytes,
        background_workers=settings.batch_workers,
        background_entry=chunk.answer,
    )
    return ClusterPool(behind, settings.cluster, there, template)


def create_app(settings: Settings | None = None, template: Template | None = None, told: Told = tell_nobody) -> FastAPI:
    """The application; its database is migrated and its workers are started when it starts.

    ``template`` is one that was started already, to import beside this process; ``told`` hears how far kernels are.
    """
    settings = settings or Settings()
    configure(settings.log_format, settings.log_level)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        pool = _pool(settings, template, told)
        pool.start()
        upgrade(settings.database_url)
        store = RunStore(settings.database_url, keys_kept=settings.keys_kept, seen=metrics.written)
        check_protected(settings, store)
        service = Service(
            store,
            pool,
            settings.solve_budget_s,
            ServiceLimits(
                settings.queue_patience_s,
                settings.short_solve_s,
                settings.max_accepted,
                settings.max_accepted_of_one,
                settings.lease_s,
            ),
            Turns(TurnLimits(settings.workers, settings.max_waiting, settings.max_waiting_of_one)),
        )
        app.state.service = service
        metrics.watch(service.turns, service.accepted)
        downloads = app.state.downloads = Downloads(InTurn(service), settings.solve_budget_s)
        app.state.batches = many = BatchService(
            store, pool, settings.solve_budget_s, settings.lease_s, settings.max_batch_items
        )
        service.start()
        many.start()
        upkeep = asyncio.create_task(expire_daily(store))
        try:
            yield
        finally:
            upkeep.cancel()
            await downloads.close()
            await many.close()
            await service.close()
            pool.close()
            store.close()

    app = GuardedFastAPI(
        title="Crankwright",
        version=VERSION,
        summary="Design optimization for crank mechanisms",
        lifespan=lifespan,
        # The framework's own pages of the reference fetch their scripts from elsewhere.
        docs_url=None,
        redoc_url=None,
        dependencies=[Depends(check_forgery)],
        telemetry={"auto_configure": True, "exclude": untold},
        generate_unique_id_function=lambda route: route.name.replace("-", "_"),
    )
    app.state.settings = settings
    app.state.keys = ring = KeyRing(lambda: app.state.service.store)
    app.state.sessions = sessions = Sessions(3600.0 * settings.session_hours)

    async def in_force() -> bool:
        return not settings.open and (not settings.is_local or await ring.any())

    def known(inner: Application) -> Application:
        counted = Quotas(inner, settings.request_quota) if settings.request_quota else inner
        return Gate(counted, ring, sessions, in_force)

    app.guard = lambda inner: edge(inner, settings, lambda: app.state.service.stopping.is_set(), known)
    errors.install(app, problem_page)
    # What is small is not worth it; a level beyond costs more time than it saves bytes.
    app.add_middleware(GZipMiddleware, minimum_size=1000, compresslevel=5)
    app.add_middleware(Speaking)
    app.add_middleware(Heads)
    contract.install(app)
    for router in (
        operation.router,
        runs.router,
        exports.router,
        catalogue.router,
        batches.router,
        submissions.router,
        pages.router,
        form_pages.router,
        run_pages.router,
        batch_pages.router,
        actions.router,
        worth.router,
        reference.router,
        login.router,
    ):
        app.include_router(router)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    Instrumentator(excluded_handlers=["/metrics"]).instrument(app).expose(app, include_in_schema=False)
    return app
