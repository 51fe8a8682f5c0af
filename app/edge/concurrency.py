"""Limit on concurrent requests."""

from __future__ import annotations

from app.edge.asgi import CLOSE, Application, Receive, Scope, Send, refuse
from app.errors import Problem

HEALTH_PATHS = ("/healthz", "/startedz", "/readyz", "/metrics")
"""Health checks and metrics, which must respond even under overload."""


class ConcurrencyLimiter:
    """Middleware that responds 503 while ``limit`` requests are in progress; health checks are exempt."""

    def __init__(self, app: Application, limit: int) -> None:
        self._app, self._limit, self._active = app, limit, 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] in HEALTH_PATHS:
            await self._app(scope, receive, send)
            return
        if self._active >= self._limit:
            detail = f"{self._active} requests are in progress"
            problem = Problem(503, "Too many requests at once", detail, headers=CLOSE | {"Retry-After": "1"})
            await refuse(scope, receive, send, problem)
            return
        self._active += 1
        try:
            await self._app(scope, receive, send)
        finally:
            self._active -= 1
