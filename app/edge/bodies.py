"""Size, time limits and encoding of request bodies."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from app.edge.asgi import ARRIVED, CLOSE, Application, Message, Receive, Scope, Send, header, refuse
from app.errors import Problem

_POLL_INTERVAL_S = 0.5

_COMPRESSED = Problem(415, "The request is compressed", "send it without Content-Encoding", headers=CLOSE)


@dataclass(frozen=True)
class BodyLimits:
    """Limits of a request body.

    ``max_bytes``: its size, overridden by ``per_path`` for path prefixes. ``idle_s``: pause without data.
    ``min_bytes_per_s``: mean rate required after ``grace_s``. Only the time in which the application waits for the
    sender counts.
    """

    max_bytes: int
    per_path: Mapping[str, int] = field(default_factory=dict)
    idle_s: float = 10.0
    grace_s: float = 20.0
    min_bytes_per_s: float = 1000.0

    def of(self, path: str) -> int:
        for start, limit in self.per_path.items():
            if path.startswith(start):
                return limit
        return self.max_bytes


class BodyLimiter:
    """Middleware that refuses bodies that are compressed (415), too large (413), stall or trickle (408), or are still
    being sent at shutdown (503), as soon as that is detected."""

    def __init__(self, app: Application, limits: BodyLimits, stopping: Callable[[], bool]) -> None:
        self._app, self._limits, self._stopping = app, limits, stopping

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        if (header(scope, b"content-encoding") or b"identity").lower() != b"identity":
            await refuse(scope, receive, send, _COMPRESSED)
            return
        limit = self._limits.of(scope["path"])
        if scope.get(ARRIVED, limit + 1) <= limit:  # as nearly always: the body came with the head
            await self._app(scope, receive, send)
            return
        body = _Body(receive, send, self._limits, limit, self._stopping)
        length = header(scope, b"content-length")
        if length is not None and length.isdigit() and int(length) > body.limit:
            await refuse(scope, receive, send, body.too_large())
            return
        try:
            await self._app(scope, body.receive, body.send)
        except Exception:
            # The application was told that the client disconnected, and may have failed because of that.
            if body.problem is None:
                raise
        if body.problem is not None and not body.responding:
            await refuse(scope, receive, send, body.problem)


class _Body:
    """A body being received. Once refused, the application sees a disconnect and cannot respond any more."""

    def __init__(
        self, receive: Receive, send: Send, limits: BodyLimits, limit: int, stopping: Callable[[], bool]
    ) -> None:
        self._receive, self._send, self._limits, self.limit, self._stopping = receive, send, limits, limit, stopping
        self._waited_s, self._size, self._complete = 0.0, 0, False
        self.problem: Problem | None = None
        self.responding = False
        """Whether the application has started to respond."""

    def too_large(self) -> Problem:
        return Problem(413, "The request is too large", f"at most {self.limit} bytes are accepted", headers=CLOSE)

    async def receive(self) -> Message:
        if self.problem is not None:
            return {"type": "http.disconnect"}
        if self._complete:
            return await self._receive()
        message = await self._part()
        if message is None or message["type"] != "http.request":
            return message or {"type": "http.disconnect"}
        self._size += len(message.get("body", b""))
        self._complete = not message.get("more_body", False)
        if self._size > self.limit:
            self.problem = self.too_large()
            return {"type": "http.disconnect"}
        return message

    async def _part(self) -> Message | None:
        """The next message; None if the body is refused.

        The server's ``receive`` takes what has arrived in one step, so cancelling it loses nothing.
        """
        began = time.monotonic()
        ends, message = began + self._limits.idle_s, None
        while message is None:
            try:
                async with asyncio.timeout(min(_POLL_INTERVAL_S, ends - time.monotonic())):
                    message = await self._receive()
            except TimeoutError:
                self.problem = self._refusal(began, ends)
                if self.problem is not None:
                    return None
        self._waited_s += time.monotonic() - began
        if message.get("more_body") and self._trickles():
            self.problem = Problem(408, "The request came too slowly", "its body trickled", headers=CLOSE)
            return None
        return message

    def _refusal(self, began: float, ends: float) -> Problem | None:
        """The reason for not waiting any longer for the next part, if any."""
        now = time.monotonic()
        if self._stopping():
            return Problem(
                503, "The service stops", "the request did not arrive in time", headers=CLOSE | {"Retry-After": "5"}
            )
        if now >= ends or self._trickles(now - began):
            return Problem(408, "The request came too slowly", "its body did not arrive in time", headers=CLOSE)
        return None

    def _trickles(self, waiting_s: float = 0.0) -> bool:
        counted_s = self._waited_s + waiting_s - self._limits.grace_s
        return counted_s > 0 and self._size < counted_s * self._limits.min_bytes_per_s

    async def send(self, message: Message) -> None:
        if self.problem is not None and not self.responding:
            return
        self.responding = True
        await self._send(message)
