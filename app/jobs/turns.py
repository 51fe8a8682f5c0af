"""Whose turn it is at the workers: short work never waits for long, and nobody's for much of one other's.

Long work leaves one worker free, if there are two. Of those who wait, each caller in turn gets the next worker.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections import Counter, OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from enum import StrEnum

from app.jobs.errors import Busy, ShareUsed

_WEIGHT = 0.1
"""Of the newest duration in the mean by which waiting times are told."""
_LONGEST_TOLD_S = 600


class Length(StrEnum):
    """What kind of work: that ends in a moment, or that may take its time."""

    SHORT = "short"
    LONG = "long"


@dataclass(frozen=True)
class TurnLimits:
    """How many may work at once, and how many may wait for it, of each length: in all, and of one caller."""

    workers: int = 2
    waiting: int = 256
    waiting_of_one: int = 64

    @property
    def most_long(self) -> int:
        return max(1, self.workers - 1)


class Turns:
    """Hands out turns; belongs to one event loop."""

    def __init__(self, limits: TurnLimits) -> None:
        self.limits = limits
        self._waiting: dict[Length, OrderedDict[str, deque[asyncio.Future[None]]]] = {
            length: OrderedDict() for length in Length
        }
        self._running: Counter[Length] = Counter()
        self._usual_s = {Length.SHORT: 0.1, Length.LONG: 2.0}

    def running(self, length: Length) -> int:
        return self._running[length]

    def waiting(self, length: Length, caller: str | None = None) -> int:
        """How many wait, in all or of one caller."""
        queues = self._waiting[length]
        return sum(map(len, queues.values())) if caller is None else len(queues.get(caller, ()))

    @asynccontextmanager
    async def turn(self, length: Length, caller: str, patience_s: float | None = None) -> AsyncIterator[None]:
        """A worker's place for as long as the block runs.

        Raises Busy where too many wait, or none came free within ``patience_s``; ShareUsed where too many of this
        caller's do. Without ``patience_s`` it was promised already, and waits as long as it takes.
        """
        await self._begin(length, caller, patience_s)
        began = time.monotonic()
        try:
            yield
        finally:
            took = time.monotonic() - began
            self._usual_s[length] += _WEIGHT * (took - self._usual_s[length])
            self._end(length)

    def retry_s(self, length: Length, ahead: int) -> float:
        """After how many seconds as many turns have come."""
        workers = self.limits.workers if length is Length.SHORT else self.limits.most_long
        return float(min(_LONGEST_TOLD_S, max(1, math.ceil(ahead * self._usual_s[length] / workers))))

    async def _begin(self, length: Length, caller: str, patience_s: float | None) -> None:
        queues = self._waiting[length]
        if not queues and self._is_free(length):
            self._running[length] += 1
            return
        if patience_s is not None:
            self._check_room(length, caller)
        granted = asyncio.get_running_loop().create_future()
        queues.setdefault(caller, deque()).append(granted)
        self._grant()
        try:
            await asyncio.wait({granted}, timeout=patience_s)
        except asyncio.CancelledError:
            self._withdraw(length, caller, granted)
            raise
        if not granted.done():
            self._withdraw(length, caller, granted)
            raise Busy(f"no worker came free within {patience_s:g} s", self.retry_s(length, self.waiting(length)))

    def _check_room(self, length: Length, caller: str) -> None:
        own, everyone = self.waiting(length, caller), self.waiting(length)
        if own >= self.limits.waiting_of_one:
            told = f"{own} solves of yours wait already"
            raise ShareUsed(told, self.retry_s(length, len(self._waiting[length])))
        if everyone >= self.limits.waiting:
            raise Busy(f"{everyone} solves wait already", self.retry_s(length, everyone))

    def _withdraw(self, length: Length, caller: str, granted: asyncio.Future[None]) -> None:
        if granted.done():
            self._end(length)
            return
        granted.cancel()
        queue = self._waiting[length][caller]
        queue.remove(granted)
        if not queue:
            del self._waiting[length][caller]

    def _end(self, length: Length) -> None:
        self._running[length] -= 1
        self._grant()

    def _is_free(self, length: Length) -> bool:
        if self._running.total() >= self.limits.workers:
            return False
        if length is Length.LONG:
            return self._running[length] < self.limits.most_long
        # Beyond the worker that is theirs anyway, short ones let a waiting long one go first.
        mine = self._running[length] < 1
        return mine or not self._waiting[Length.LONG] or self._running[Length.LONG] >= self.limits.most_long

    def _grant(self) -> None:
        for length in Length:
            queues = self._waiting[length]
            while queues and self._is_free(length):
                caller, queue = queues.popitem(last=False)
                granted = queue.popleft()
                if queue:  # to the end of the row
                    queues[caller] = queue
                self._running[length] += 1
                granted.set_result(None)
