"""One piece of work for all who ask for the same at the same time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Hashable
from dataclasses import dataclass
from typing import Any

from app.store.errors import IdempotencyConflict


@dataclass
class _Flight:
    content: str
    task: asyncio.Task[Any]
    waiting: int = 0


class Flights:
    """Work under way, by key. It goes on as long as anybody waits for it."""

    def __init__(self) -> None:
        self._under_way: dict[Hashable, _Flight] = {}

    async def once(self, key: Hashable, content: str, begin: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
        """What ``begin`` gives, begun once for all that come with this key meanwhile.

        Raises IdempotencyConflict where the key is under way for another ``content``.
        """
        flight = self._under_way.get(key)
        if flight is None:
            flight = self._under_way[key] = _Flight(content, asyncio.create_task(begin()))
            flight.task.add_done_callback(lambda _: self._land(key, flight))
        elif flight.content != content:
            raise IdempotencyConflict(str(key))
        flight.waiting += 1
        try:
            return await asyncio.shield(flight.task)
        finally:
            flight.waiting -= 1
            if not flight.waiting and not flight.task.done():
                # Whoever comes now begins anew, and does not get an end that was not meant for him.
                self._land(key, flight)
                flight.task.cancel()

    def _land(self, key: Hashable, flight: _Flight) -> None:
        if self._under_way.get(key) is flight:
            del self._under_way[key]
