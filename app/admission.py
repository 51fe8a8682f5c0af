"""Calls of the executor when the service's fair queue admits them."""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from app.access.caller import caller
from app.designs.progress import Report, ignore_progress
from app.jobs.errors import BudgetExceeded, WorkerCrashed
from app.jobs.executor import Executor
from app.jobs.fair_queue import FairQueue, JobLength

OnStart = Callable[[], Awaitable[object]]
"""Called when an accepted run gets a worker."""
Call = Callable[[float, Report], Awaitable[Any]]
"""``(kill timeout in seconds, report) -> answer``"""

_SHORT_TRIES = 2  # a quick job may once have been delayed by a loaded machine
_EXPORT_PATIENCE = 5.0  # a report takes 0.2 s of an idle processor, and no file more than a few times that
_CRASH_RETRIES = 5
"""Retries of an accepted run whose worker crashed, for example killed by the system."""


@dataclass(frozen=True)
class Admission:
    """Runs calls in the turn of their callers.

    ``max_wait_s``: how long a request waits for a worker. ``short_s``: time after which a short job starts again.
    """

    queue: FairQueue
    max_wait_s: float
    short_s: float

    async def run(
        self,
        call: Call,
        kill_s: float,
        short: bool,
        report: Report = ignore_progress,
        on_start: OnStart | None = None,
        patience: float = 1.0,
    ) -> Any:
        """Run a call when the fair queue admits it.

        Accepted runs (with ``on_start``) wait without limit and are retried after crashes. A short job that exceeds
        ``short_s``, times ``patience``, gives its worker back and starts again, the second time as a long one.
        """
        short_s = patience * self.short_s
        who, max_wait_s = caller.get().name, None if on_start else self.max_wait_s
        for _ in range(_SHORT_TRIES if short else 0):
            async with self.queue.slot(JobLength.SHORT, who, max_wait_s):
                try:
                    return await call(min(kill_s, short_s), report)
                except BudgetExceeded:
                    if kill_s <= short_s:
                        raise
        async with self.queue.slot(JobLength.LONG, who, max_wait_s):
            if on_start is not None:
                await on_start()
                for _ in range(_CRASH_RETRIES):
                    with contextlib.suppress(WorkerCrashed):
                        return await call(kill_s, report)
            return await call(kill_s, report)


@dataclass(frozen=True)
class QueuedExecutor:
    """Executor of exports, as short jobs in the service's fair queue."""

    executor: Executor
    admission: Admission

    async def run(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        """See ``Executor.run``."""
        call = partial(self.executor.run, kind_slug, mode, payload)
        return await self.admission.run(call, budget_s, short=True, patience=_EXPORT_PATIENCE)
