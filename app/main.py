"""The service: settings in, ASGI application out."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import Depends, FastAPI
from fastapi.staticfiles import StaticFiles
from fastapi.telemetry import TelemetryConfig

from app import errors, metrics
from app.access.authentication import Authentication
from app.access.csrf import check_csrf
from app.access.keys import KeyCache
from app.access.protection import check_protected
from app.access.quotas import Quotas
from app.access.sessions import Sessions
from app.admission import QueuedExecutor
from app.api import batches, catalogue, contract, exports, operation, runs, submissions
from app.api.head_requests import Heads
from app.api.one_by_one import OneByOne
from app.batches import chunk
from app.batches.service import BatchService
from app.batches.workers import chunk_workers
from app.edge.asgi import Application, Scope
from app.edge.compression import Compression
from app.edge.concurrency import HEALTH_PATHS
from app.edge.request_metrics import RequestMetrics
from app.edge.stack import FastAPIBehindEdge, edge
from app.jobs.executor import PoolSettings, ProcessPool
from app.jobs.fair_queue import FairQueue, QueueLimits
from app.jobs.fork_server import ForkServer
from app.jobs.warming import StatusListener, ignore_status
from app.logging import configure, get_logger
from app.run_exports import RunExports
from app.settings import Settings
from app.store.errors import StoreError
from app.store.migrate import upgrade
from app.store.repository import RunStore
from app.submission import Service, ServiceLimits
from app.version import VERSION
from app.web import actions, batch_pages, form_pages, login, pages, reference, run_pages, worth
from app.web.languages import Speaking
from app.web.problems import problem_page
from app.web.rendering import STATIC

logger = get_logger(__name__)


def untraced(scope: Scope) -> bool:
    """Exclude requests for static files and health checks from traces."""
    return scope["path"] in HEALTH_PATHS or scope["path"].startswith("/static/")


def _telemetry() -> TelemetryConfig:
    """OpenTelemetry as the standard variables say; without any, FastAPI need not look for it in every request."""
    wanted = any(name.startswith("OTEL_") for name in os.environ)
    return {"auto_configure": True, "exclude": untraced, "tracing": wanted, "metrics": wanted, "logs": wanted}


_DAY_S = 24 * 3600.0


async def expire_keys_daily(store: RunStore) -> None:
    """Delete expired idempotency keys, at start-up and daily."""
    while True:
        try:
            await store.expire_keys()
        except StoreError as error:
            logger.error("key_expiry_failed", reason=str(error))
        await asyncio.sleep(_DAY_S)


def _pool(settings: Settings, fork_server: ForkServer | None, on_status: StatusListener) -> ProcessPool:
    """Workers for interactive requests, and low-priority ones for batches on this machine or on a cluster."""
    local = PoolSettings(
        workers=settings.workers,
        memory_bytes=settings.solve_memory_bytes,
        on_status=on_status,
        background_workers=0 if settings.cluster else settings.batch_workers,
        background_entry=chunk.answer,
        background_niceness=settings.batch_niceness,
    )
    if not settings.cluster:
        return ProcessPool(local, fork_server)
    from app.jobs.cluster import ClusterPool

    return ClusterPool(local, settings.cluster, chunk_workers(settings), fork_server)


def create_app(
    settings: Settings | None = None, fork_server: ForkServer | None = None, on_status: StatusListener = ignore_status
) -> FastAPI:
    """The application. Its lifespan migrates the database and starts the workers.

    ``fork_server`` is one already started, to import in parallel with this process; ``on_status`` receives the kernels'
    warm-up status.
    """
    settings = settings or Settings()
    configure(settings.log_format, settings.log_level)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        pool = _pool(settings, fork_server, on_status)
        pool.start()
        upgrade(settings.database_url)
        store = RunStore(settings.database_url, key_lifetime=settings.key_lifetime, on_commit=metrics.record_write)
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
            FairQueue(QueueLimits(settings.workers, settings.max_waiting, settings.max_waiting_of_one)),
        )
        app.state.service = service
        metrics.watch(service.queue, service.open_accepted)
        exports_of_runs = app.state.exports = RunExports(
            QueuedExecutor(service.executor, service.admission), settings.solve_budget_s
        )
        app.state.batches = many = BatchService(
            store,
            pool,
            settings.solve_budget_s,
            settings.lease_s,
            settings.max_batch_items,
            settings.max_batches_of_one,
        )
        service.start()
        many.start()
        expiry = asyncio.create_task(expire_keys_daily(store))
        try:
            yield
        finally:
            expiry.cancel()
            await exports_of_runs.close()
            await many.close()
            await service.close()
            pool.close()
            store.close()

    app = FastAPIBehindEdge(
        title="Crankwright",
        version=VERSION,
        summary="Design optimization for crank mechanisms",
        lifespan=lifespan,
        # FastAPI's own documentation pages load scripts from a CDN.
        docs_url=None,
        redoc_url=None,
        dependencies=[Depends(check_csrf)],
        telemetry=_telemetry(),
        generate_unique_id_function=lambda route: route.name.replace("-", "_"),
    )
    app.state.settings = settings
    app.state.large_bodies = OneByOne()
    app.state.keys = keys = KeyCache(lambda: app.state.service.store)
    app.state.sessions = sessions = Sessions(3600.0 * settings.session_hours)

    async def keys_required() -> bool:
        return not settings.open and (not settings.is_local or await keys.any())

    def authenticate(inner: Application) -> Application:
        counted = Quotas(inner, settings.request_quota) if settings.request_quota else inner
        return Authentication(counted, keys, sessions, keys_required)

    errors.install(app, problem_page)
    app.add_middleware(Speaking)
    contract.install(app)
    solves = submissions.install(app)

    def guard(inner: Application) -> Application:
        routed = RequestMetrics(submissions.Solves(inner, solves, app.exception_handlers))
        answering = Heads(Compression(routed))
        return edge(answering, settings, lambda: app.state.service.stopping.is_set(), authenticate)

    app.guard = guard
    for router in (
        operation.router,
        runs.router,
        exports.router,
        catalogue.router,
        batches.router,
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
    return app
