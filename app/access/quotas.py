"""How many requests a caller may send in a minute."""

from __future__ import annotations

import math
import time

from limits import RateLimitItemPerMinute
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter

from app.access.caller import caller
from app.edge.asgi import Application, Receive, Scope, Send, refuse
from app.edge.crowds import ALWAYS
from app.errors import Problem

UNCOUNTED = (*ALWAYS, "/favicon.ico")


class Quotas:
    """Refuses (429) what a caller sends beyond ``per_minute`` requests within any 60 s, and says when to come again.

    Files of the pages and what tells how the service is are not counted.
    """

    def __init__(self, app: Application, per_minute: int) -> None:
        self._app, self._item = app, RateLimitItemPerMinute(per_minute)
        self._limiter = MovingWindowRateLimiter(MemoryStorage())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        counted = (
            scope["type"] == "http" and scope["path"] not in UNCOUNTED and not scope["path"].startswith("/static/")
        )
        who = caller.get().name
        if not counted or self._limiter.hit(self._item, who):
            await self._app(scope, receive, send)
            return
        reset = self._limiter.get_window_stats(self._item, who).reset_time
        wait = max(1, math.ceil(reset - time.time()))
        told = f"{self._item.amount} requests a minute are yours, and they are used"
        await refuse(scope, receive, send, Problem(429, "Too many requests", told, headers={"Retry-After": str(wait)}))
