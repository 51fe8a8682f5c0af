"""Deduplication of concurrent requests with the same key."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Hashable
from dataclasses import dataclass
from typing import Any

from app.store.errors import IdempotencyConflict


@dataclass
class _PendingCall:
    content: str
    task: asyncio.Task[Any]
    waiting: int = 0


class SingleFlight:
    """Calls in progress, by key; each continues as long as at least one caller waits for it."""

    def __init__(self) -> None:
        self._in_flight: dict[Hashable, _PendingCall] = {}

    async def run(self, key: Hashable, content: str, begin: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
        """Return the result of ``begin``, started once for all concurrent callers with this key.

        Raises IdempotencyConflict if a call with another ``content`` is in progress under the key.
        """
        call = self._in_flight.get(key)
        if call is None:
            call = self._in_flight[key] = _PendingCall(content, asyncio.create_task(begin()))
            call.task.add_done_callback(lambda _: self._forget(key, call))
        elif call.content != content:
            raise IdempotencyConflict(str(key))
        call.waiting += 1
        try:
            return await asyncio.shield(call.task)
        finally:
            call.waiting -= 1
            if not call.waiting and not call.task.done():
                # A later caller must start anew rather than share this cancellation.
                self._forget(key, call)
                call.task.cancel()

    def _forget(self, key: Hashable, call: _PendingCall) -> None:
        if self._in_flight.get(key) is call:
            del self._in_flight[key]
