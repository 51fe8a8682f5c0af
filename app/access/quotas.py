"""Request quotas per caller."""

from __future__ import annotations

import math
import time

from limits import RateLimitItemPerMinute
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter

from app.access.caller import caller
from app.edge.asgi import Application, Receive, Scope, Send, refuse
from app.edge.concurrency import HEALTH_PATHS
from app.errors import Problem

EXEMPT_PATHS = (*HEALTH_PATHS, "/favicon.ico")


class Quotas:
    """Middleware that responds 429 with Retry-After beyond ``per_minute`` requests within any 60 s.

    Static files and health checks are not counted.
    """

    def __init__(self, app: Application, per_minute: int) -> None:
        self._app, self._item = app, RateLimitItemPerMinute(per_minute)
        self._limiter = MovingWindowRateLimiter(MemoryStorage())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        counted = (
            scope["type"] == "http" and scope["path"] not in EXEMPT_PATHS and not scope["path"].startswith("/static/")
        )
        who = caller.get().name
        if not counted or self._limiter.hit(self._item, who):
            await self._app(scope, receive, send)
            return
        reset = self._limiter.get_window_stats(self._item, who).reset_time
        wait = max(1, math.ceil(reset - time.time()))
        detail = f"the quota of {self._item.amount} requests per minute is used up"
        await refuse(
            scope, receive, send, Problem(429, "Too many requests", detail, headers={"Retry-After": str(wait)})
        )
