"""An event loop with virtual time, which advances to the next timer when idle."""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Coroutine
from typing import Any


class _Leaping(selectors.DefaultSelector):
    """Never blocks; the waiting time is added to the clock."""

    leapt = 0.0

    def select(self, timeout: float | None = None) -> list[Any]:
        self.leapt += max(0.0, timeout or 0.0)
        return super().select(0 if timeout is not None else None)


class Clockwork(asyncio.SelectorEventLoop):
    """Its ``time`` begins at 0 and is that of the timers alone."""

    def __init__(self) -> None:
        self._leaping = _Leaping()
        super().__init__(self._leaping)

    def time(self) -> float:
        return self._leaping.leapt


def by_clockwork(story: Coroutine[Any, Any, Any]) -> Any:
    """Run a coroutine in virtual time and return its result."""
    with asyncio.Runner(loop_factory=Clockwork) as runner:
        return runner.run(story)
