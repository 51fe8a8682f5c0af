"""Compression of responses."""

from __future__ import annotations

from starlette.middleware.gzip import GZipMiddleware
from starlette.types import ASGIApp, Receive, Scope, Send

from app.edge.asgi import header


class Compression(GZipMiddleware):
    """Middleware that compresses a response where the client accepts it.

    Level 1 takes a fifth of level 5's time on the curves of an analysis (0.7 ms for 92 kB) and leaves 4 % more. For a
    client that names no encodings there is no overhead.
    """

    def __init__(self, app: ASGIApp) -> None:
        super().__init__(app, minimum_size=1000, compresslevel=1)  # small responses are not worth it

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and header(scope, b"accept-encoding") is not None:
            await super().__call__(scope, receive, send)
        else:
            await self.app(scope, receive, send)
