"""How many requests may be under way at once."""

from __future__ import annotations

from app.edge.asgi import CLOSE, Application, Receive, Scope, Send, refuse
from app.errors import Problem

ALWAYS = ("/healthz", "/startedz", "/readyz", "/metrics")
"""What tells how the service is must be told then above all."""


class BoundedCrowds:
    """Refuses a request (503) while ``most`` others are under way, except those that ask how the service is."""

    def __init__(self, app: Application, most: int) -> None:
        self._app, self._most, self._under_way = app, most, 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["path"] in ALWAYS:
            await self._app(scope, receive, send)
            return
        if self._under_way >= self._most:
            told = f"{self._under_way} requests are under way already"
            problem = Problem(503, "Too many requests at once", told, headers=CLOSE | {"Retry-After": "1"})
            await refuse(scope, receive, send, problem)
            return
        self._under_way += 1
        try:
            await self._app(scope, receive, send)
        finally:
            self._under_way -= 1
