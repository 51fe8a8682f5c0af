"""The middleware stack, from the outside in."""

from __future__ import annotations

from collections.abc import Callable

from fastapi import FastAPI

from app.addresses import is_address
from app.edge.asgi import Application
from app.edge.bodies import BodyLimiter, BodyLimits
from app.edge.concurrency import ConcurrencyLimiter
from app.edge.hosts import HostAndOriginCheck
from app.edge.request_heads import HeadLimiter
from app.edge.request_log import RequestLog
from app.edge.response_headers import SecurityHeaders
from app.settings import Settings

BATCHES = "/api/v1/batches"
UPLOADS = "/batches/upload"
"""Paths with larger body limits."""


def edge(
    inner: Application,
    settings: Settings,
    stopping: Callable[[], bool],
    authenticate: Callable[[Application], Application] = lambda inner: inner,
) -> Application:
    """Wrap the application in the middleware stack; ``authenticate`` adds authentication inside it."""
    names = [name.strip() for name in settings.allowed_hosts.split(",") if name.strip()]
    limits = BodyLimits(
        settings.max_body_bytes,
        {BATCHES: settings.max_batch_bytes, UPLOADS: settings.max_upload_bytes},
        settings.body_idle_s,
        settings.body_grace_s,
        settings.body_least_bytes_per_s,
    )
    guarded: Application = authenticate(BodyLimiter(inner, limits, stopping))
    guarded = ConcurrencyLimiter(guarded, settings.max_requests)
    guarded = HostAndOriginCheck(guarded, names if is_address(settings.host) else [*names, settings.host])
    guarded = HeadLimiter(guarded, settings.max_head_bytes, settings.max_headers)
    return RequestLog(SecurityHeaders(guarded))


class FastAPIBehindEdge(FastAPI):
    """A FastAPI application whose error responses pass the middleware stack, too."""

    guard: Callable[[Application], Application] | None = None

    def build_middleware_stack(self) -> Application:  # type: ignore[override]
        inner = super().build_middleware_stack()
        return inner if self.guard is None else self.guard(inner)
