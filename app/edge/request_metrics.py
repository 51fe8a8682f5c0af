"""Prometheus metrics of requests."""

from __future__ import annotations

import time

from prometheus_client import Counter, Histogram
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.metrics import labelled

REQUESTS = Counter("http_requests", "Finished requests", ["method", "status", "handler"])
SECONDS = Histogram(
    "http_request_duration_seconds",
    "Seconds per request",
    ["method", "handler"],
    buckets=(0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0),
)
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
"""Methods with a label of their own; all others share one, because clients could invent any number of them."""


class RequestMetrics:
    """Middleware that counts and times requests by the route that answered them, directly around the router: the scope
    then names that route, and it need not be found a second time."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] == "/metrics":
            await self.app(scope, receive, send)
            return
        began, status = time.perf_counter(), 500

        async def noted(message: Message) -> None:
            nonlocal status
            status = message.get("status", status)
            await send(message)

        try:
            await self.app(scope, receive, noted)
        finally:
            # A mounted application has no route, but a path of its own.
            handler = getattr(scope.get("route"), "path", None) or scope.get("root_path") or "none"
            method = scope["method"] if scope["method"] in _METHODS else "other"
            labelled(REQUESTS, method, f"{status // 100}xx", handler).inc()
            labelled(SECONDS, method, handler).observe(time.perf_counter() - began)
