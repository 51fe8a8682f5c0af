"""How much of a body is read, and for how long."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from app.edge.asgi import CLOSE, Application, Message, Receive, Scope, Send, header, refuse
from app.errors import Problem

_LOOK_S = 0.5


@dataclass(frozen=True)
class BodyLimits:
    """``most_bytes`` of a body, with others for paths that begin in one of ``of_paths``; ``idle_s`` without any byte;
    after ``grace_s`` a body must have come at ``least_bytes_per_s`` in the mean."""

    most_bytes: int
    of_paths: Mapping[str, int] = field(default_factory=dict)
    idle_s: float = 10.0
    grace_s: float = 20.0
    least_bytes_per_s: float = 1000.0

    def of(self, path: str) -> int:
        return next((most for start, most in self.of_paths.items() if path.startswith(start)), self.most_bytes)


class BoundedBodies:
    """Refuses bodies that are too large (413), that stop coming or trickle (408), or that come on while the service
    stops (503): as soon as it shows, however the body is sent and whoever reads it."""

    def __init__(self, app: Application, limits: BodyLimits, stopping: Callable[[], bool]) -> None:
        self._app, self._limits, self._stopping = app, limits, stopping

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        body = _Body(receive, send, self._limits, self._limits.of(scope["path"]), self._stopping)
        length = header(scope, b"content-length")
        if length is not None and length.isdigit() and int(length) > body.most:
            await refuse(scope, receive, send, body.too_large())
            return
        try:
            await self._app(scope, body.receive, body.send)
        except Exception:
            # Whoever read the body was told that the client is gone, and may have failed for it.
            if body.problem is None:
                raise
        finally:
            body.forget()
        if body.problem is not None and not body.answered:
            await refuse(scope, receive, send, body.problem)


class _Body:
    """One body on its way. Once it is refused its reader is told that the client is gone, and gets no word in."""

    def __init__(
        self, receive: Receive, send: Send, limits: BodyLimits, most: int, stopping: Callable[[], bool]
    ) -> None:
        self._receive, self._send, self._limits, self.most, self._stopping = receive, send, limits, most, stopping
        self._began, self._size, self._whole = time.monotonic(), 0, False
        self._next: asyncio.Future[Message] | None = None
        self.problem: Problem | None = None
        self.answered = False
        """Whether the application's own answer is under way."""

    def too_large(self) -> Problem:
        return Problem(413, "The request is too large", f"at most {self.most} bytes are accepted", headers=CLOSE)

    async def receive(self) -> Message:
        if self.problem is not None:
            return {"type": "http.disconnect"}
        if self._whole:
            return await self._receive()
        message = await self._part()
        if message is None or message["type"] != "http.request":
            return message or {"type": "http.disconnect"}
        self._size += len(message.get("body", b""))
        self._whole = not message.get("more_body", False)
        if self._size > self.most:
            self.problem = self.too_large()
            return {"type": "http.disconnect"}
        return message

    async def _part(self) -> Message | None:
        """The next message; None where the body is refused."""
        self._next = asyncio.ensure_future(self._receive())
        waited = time.monotonic()
        ends = waited + self._limits.idle_s
        while not (await asyncio.wait({self._next}, timeout=min(_LOOK_S, ends - time.monotonic())))[0]:
            now = time.monotonic()
            if self._stopping():
                self.problem = Problem(
                    503, "The service stops", "the request did not arrive in time",
                    headers=CLOSE | {"Retry-After": "5"},
                )  # fmt: skip
            elif now >= ends or self._trickles(now):
                self.problem = Problem(408, "The request came too slowly", "its body did not arrive in time",
                                       headers=CLOSE)  # fmt: skip
            if self.problem is not None:
                return None
        message = self._next.result()
        if message.get("more_body") and self._trickles(time.monotonic()):
            self.problem = Problem(408, "The request came too slowly", "its body trickled", headers=CLOSE)
            return None
        return message

    def _trickles(self, now: float) -> bool:
        elapsed = now - self._began - self._limits.grace_s
        return elapsed > 0 and self._size < elapsed * self._limits.least_bytes_per_s

    async def send(self, message: Message) -> None:
        if self.problem is not None and not self.answered:
            return
        self.answered = True
        await self._send(message)

    def forget(self) -> None:
        if self._next is not None and not self._next.done():
            self._next.cancel()
