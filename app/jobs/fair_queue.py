"""Admission to the workers: short jobs never wait long, and callers take turns.

Long jobs leave one worker free where there are at least two. Of the callers that wait, the one served least recently
comes first: a caller with one quick job waits for the jobs that run, never for the backlog of another.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections import Counter, deque
from dataclasses import dataclass
from enum import StrEnum

from app.jobs.errors import Busy, ShareUsed
from app.jobs.turns import Turns

_SMOOTHING = 0.1
"""Weight of the latest duration in the exponential moving average behind Retry-After."""
_MAX_RETRY_S = 600


class JobLength(StrEnum):
    """Expected duration of a job: short, or up to the full budget."""

    SHORT = "short"
    LONG = "long"


_LENGTHS = tuple(JobLength)


@dataclass(frozen=True)
class QueueLimits:
    """Limits on running jobs and, per length, on waiting ones: in total and per caller."""

    workers: int = 2
    waiting: int = 256
    waiting_per_caller: int = 64

    @property
    def max_long(self) -> int:
        return max(1, self.workers - 1)


class Slot:
    """A worker slot, held for the duration of a block; see ``FairQueue.slot``."""

    def __init__(self, queue: FairQueue, length: JobLength, caller: str, max_wait_s: float | None) -> None:
        self._queue, self._length, self._caller, self._max_wait_s = queue, length, caller, max_wait_s

    async def __aenter__(self) -> None:
        await self._queue._acquire(self._length, self._caller, self._max_wait_s)
        self._began = time.monotonic()

    async def __aexit__(self, *_error: object) -> None:
        self._queue._free(self._length, time.monotonic() - self._began)


class FairQueue:
    """Grants worker slots; not thread-safe, belongs to one event loop."""

    def __init__(self, limits: QueueLimits) -> None:
        self.limits = limits
        self._waiting: dict[JobLength, dict[str, deque[asyncio.Future[None]]]] = {length: {} for length in JobLength}
        self._running: Counter[JobLength] = Counter()
        self._turns: Turns[str] = Turns()
        self._mean_s = {JobLength.SHORT: 0.1, JobLength.LONG: 2.0}

    def running(self, length: JobLength) -> int:
        return self._running[length]

    def waiting(self, length: JobLength, caller: str | None = None) -> int:
        """Number of waiting jobs, in total or of one caller."""
        queues = self._waiting[length]
        return sum(map(len, queues.values())) if caller is None else len(queues.get(caller, ()))

    def slot(self, length: JobLength, caller: str, max_wait_s: float | None = None) -> Slot:
        """Hold a worker slot for the duration of an ``async with`` block.

        Raises ShareUsed if too many jobs of this caller wait, Busy if too many wait in total or no slot came free
        within ``max_wait_s``. With ``max_wait_s`` None the job was accepted earlier: it is never refused and waits
        without limit.
        """
        return Slot(self, length, caller, max_wait_s)

    def retry_s(self, length: JobLength, ahead: int) -> float:
        """Estimated seconds until ``ahead`` waiting jobs have been admitted."""
        workers = self.limits.workers if length is JobLength.SHORT else self.limits.max_long
        return float(min(_MAX_RETRY_S, max(1, math.ceil(ahead * self._mean_s[length] / workers))))

    async def _acquire(self, length: JobLength, caller: str, max_wait_s: float | None) -> None:
        queues = self._waiting[length]
        if not queues and self._is_free(length):
            self._admit(length, caller)
            return
        if max_wait_s is not None:
            self._check_capacity(length, caller)
        admitted = asyncio.get_running_loop().create_future()
        queues.setdefault(caller, deque()).append(admitted)
        self._dispatch()
        try:
            await asyncio.wait({admitted}, timeout=max_wait_s)
        except asyncio.CancelledError:
            self._withdraw(length, caller, admitted)
            raise
        if not admitted.done():
            self._withdraw(length, caller, admitted)
            raise Busy(f"no worker came free within {max_wait_s:g} s", self.retry_s(length, self.waiting(length)))

    def _check_capacity(self, length: JobLength, caller: str) -> None:
        own, everyone = self.waiting(length, caller), self.waiting(length)
        if own >= self.limits.waiting_per_caller:
            message = f"{own} solves of yours wait already"
            raise ShareUsed(message, self.retry_s(length, len(self._waiting[length])))
        if everyone >= self.limits.waiting:
            raise Busy(f"{everyone} solves wait already", self.retry_s(length, everyone))

    def _withdraw(self, length: JobLength, caller: str, admitted: asyncio.Future[None]) -> None:
        if admitted.done():
            self._release(length)
            return
        admitted.cancel()
        queue = self._waiting[length][caller]
        queue.remove(admitted)
        if not queue:
            del self._waiting[length][caller]

    def _free(self, length: JobLength, took_s: float) -> None:
        self._mean_s[length] += _SMOOTHING * (took_s - self._mean_s[length])
        self._release(length)

    def _release(self, length: JobLength) -> None:
        self._running[length] -= 1
        self._dispatch()

    def _is_free(self, length: JobLength) -> bool:
        if self._running.total() >= self.limits.workers:
            return False
        if length is JobLength.LONG:
            return self._running[length] < self.limits.max_long
        # Short jobs are always entitled to one worker; for more, they yield to a waiting long job.
        reserved = self._running[length] < 1
        return reserved or not self._waiting[JobLength.LONG] or self._running[JobLength.LONG] >= self.limits.max_long

    def _dispatch(self) -> None:
        for length in _LENGTHS:
            queues = self._waiting[length]
            while queues and self._is_free(length):
                caller = self._turns.next(queues)
                admitted = queues[caller].popleft()
                if not queues[caller]:
                    del queues[caller]
                self._admit(length, caller)
                admitted.set_result(None)

    def _admit(self, length: JobLength, caller: str) -> None:
        self._running[length] += 1
        self._turns.served(caller)
