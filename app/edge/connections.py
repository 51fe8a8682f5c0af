"""Limits on connections: their number, time and size of request heads, and unread responses.

Uvicorn limits none of these: it would keep a silent connection or an endless head for ever.
"""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from app.edge.asgi import ARRIVED
from app.errors import MEDIA_TYPE

_MAX_OVERHEAD_PER_BYTE = 16
"""A one-byte chunk takes six bytes on the wire, plus chunk extensions and trailers."""
_JOINED_BYTES = 1 << 18
"""Greatest part of a body that is copied behind its head; beyond that, a system call is cheaper."""


@dataclass(frozen=True)
class ConnectionLimits:
    """Limits on connections.

    ``limit``: connections in total; ``max_per_address``: per client address. ``head_s``: time for a request head of at
    most ``head_bytes`` to arrive, also on a kept-alive connection. ``unread_s``: time a client may leave a response
    unread.
    """

    limit: int = 1000
    max_per_address: int = 250
    head_s: float = 10.0
    head_bytes: int = 32_768
    unread_s: float = 30.0


@dataclass
class Connections:
    """Open connections of a server, by client address."""

    limits: ConnectionLimits
    count_by_address: Counter[str] = field(default_factory=Counter)

    def protocol(self) -> Callable[..., asyncio.Protocol]:
        """The protocol factory for uvicorn."""

        def make(*given: Any, **named: Any) -> LimitedConnection:
            return LimitedConnection(self, *given, **named)

        return make


class _HeadWithBody:
    """The transport of one response: its head waits for the beginning of the body, at most for the current pass of the
    event loop, so that an ordinary response is one system call and wakes the client once."""

    def __init__(
        self, transport: asyncio.Transport, loop: asyncio.AbstractEventLoop, leave: Callable[[], None]
    ) -> None:
        self._transport, self._loop, self._leave = transport, loop, leave
        self._begun, self._head = False, b""

    def is_closing(self) -> bool:
        return self._transport.is_closing()

    def write(self, part: bytes) -> None:
        if not self._begun:
            self._begun, self._head = True, part
            self._loop.call_soon(self._flush)
        elif len(part) <= _JOINED_BYTES:
            head, self._head = self._head, b""
            self._transport.write(head + part)
        else:
            self._flush()
            self._transport.write(part)

    def close(self) -> None:
        self._flush()
        self._leave()

    def _flush(self) -> None:
        head, self._head = self._head, b""
        if head and not self._transport.is_closing():
            self._transport.write(head)


class LimitedConnection(HttpToolsProtocol):
    """A connection that is closed when it exceeds a limit."""

    def __init__(self, all_connections: Connections, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._all, self._limits = all_connections, all_connections.limits
        self._address: str | None = None
        self._head_open, self._head_read = True, 0
        self._begun, self._leaving = False, False
        self._rest_read, self._body_read = 0, 0
        self._timers: dict[str, asyncio.TimerHandle] = {}

    # -- lifecycle ---------------------------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        address, counts = self.client[0] if self.client else "", self._all.count_by_address
        if counts.total() >= self._limits.limit or counts[address] >= self._limits.max_per_address:
            self._end(503, "Service Unavailable", "Too many connections", "Retry-After: 5\r\n")
            return
        self._address = address
        counts[address] += 1
        self._time("head", self._limits.head_s, self._late)

    def connection_lost(self, exc: Exception | None) -> None:
        for name in tuple(self._timers):
            self._stop(name)
        if self._address is not None:
            self._all.count_by_address[self._address] -= 1
            if not self._all.count_by_address[self._address]:
                del self._all.count_by_address[self._address]
            self._address = None
        super().connection_lost(exc)

    # -- heads --------------------------------------------------------------------------------------------------

    def data_received(self, data: bytes) -> None:
        if self.transport.is_closing():
            return
        if self._head_open:
            self._head_read += len(data)
        else:
            self._rest_read += len(data)
        super().data_received(data)
        # A head that ended within these bytes is measured separately, see `HeadLimiter`.
        if self._head_open and self._head_read > self._limits.head_bytes and not self.transport.is_closing():
            self._end(431, "Request Header Fields Too Large", f"At most {self._limits.head_bytes} bytes are accepted")
        elif self._rest_read > self._limits.head_bytes + _MAX_OVERHEAD_PER_BYTE * self._body_read:
            self._end(400, "Bad Request", "too much data around the body")

    def on_message_begin(self) -> None:
        self._begun = True
        super().on_message_begin()

    def on_header(self, name: bytes, value: bytes) -> None:
        # Trailers are dropped: they would be stored with the request, at any length.
        if self._head_open:
            super().on_header(name, value)

    def on_headers_complete(self) -> None:
        if self._leaving:
            return
        self._head_open, self._head_read, self._begun = False, 0, False
        self._rest_read, self._body_read = 0, 0
        self._stop("head")
        super().on_headers_complete()
        self.cycle.transport = _HeadWithBody(self.transport, self.loop, self._leave)  # type: ignore[assignment]

    def on_body(self, body: bytes) -> None:
        self._body_read += len(body)
        super().on_body(body)

    def on_message_complete(self) -> None:
        self._head_open, self._rest_read = True, 0
        self.scope[ARRIVED] = self._body_read  # type: ignore[typeddict-unknown-key]
        super().on_message_complete()
        if self._leaving:
            self.transport.close()

    def on_response_complete(self) -> None:
        waiting = bool(self.pipeline)
        super().on_response_complete()
        if not waiting and not self.transport.is_closing():
            # The deadline for the next head starts now, whatever else arrives.
            self._time("head", self.timeout_keep_alive + self._limits.head_s, self._late)

    def _leave(self) -> None:
        """Close after a response. Where the rest of a refused body is still arriving, it is read and dropped until the
        next head is due: a connection closed before would be reset, and the client lose the response."""
        if self._head_open:
            self.transport.close()
        else:
            self._leaving = True
            self.transport.write_eof()

    def _late(self) -> None:
        if self._begun:
            self._end(408, "Request Timeout", "The head did not arrive in time")
        else:
            self.transport.close()

    # -- answers ------------------------------------------------------------------------------------------------

    def pause_writing(self) -> None:
        super().pause_writing()
        self._time("unread", self._limits.unread_s, self.transport.abort)

    def resume_writing(self) -> None:
        super().resume_writing()
        self._stop("unread")

    def send_400_response(self, msg: str) -> None:
        self._end(400, "Bad Request", msg)

    def _end(self, status: int, title: str, detail: str, more: str = "") -> None:
        """Respond without the application, and close."""
        detail = {"type": "about:blank", "title": title, "status": status, "detail": detail}
        body = json.dumps(detail).encode()
        head = (
            f"HTTP/1.1 {status} {title}\r\nContent-Type: {MEDIA_TYPE}\r\nContent-Length: {len(body)}\r\n{more}"
            "X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n"
        )
        if not self._leaving:
            self.transport.write(head.encode() + body)
        self.transport.close()

    def _time(self, name: str, seconds: float, callback: Callable[[], None]) -> None:
        self._stop(name)
        self._timers[name] = self.loop.call_later(seconds, callback)

    def _stop(self, name: str) -> None:
        timer = self._timers.pop(name, None)
        if timer is not None:
            timer.cancel()
