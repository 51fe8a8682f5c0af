"""Runs accepted with 202: each is solved by the process that holds its lease, and taken over when that process dies."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Coroutine
from typing import Any

from app.logging import get_logger
from app.store.errors import StoreError
from app.store.leases import LEASE_S, new_owner
from app.store.record import RunRecord, StoredResponse
from app.store.repository import RunStore
from app.store.run_leases import ReleaseLeases, RenewLeases, TakenOverRun, TakeOverExpired

logger = get_logger(__name__)

MAX_ATTEMPTS = 20
"""Maximum starts of a solve whose service process died each time. The run is hardly the cause, since it is solved in a
worker."""
_MAX_TAKEN_OVER = 20
"""Maximum runs taken over at a time, so that other processes get their share."""


class AcceptedRuns:
    """The accepted runs of this process and their leases; belongs to one event loop."""

    def __init__(self, store: RunStore, lease_s: float = LEASE_S) -> None:
        self._store, self._lease_s, self._owner = store, lease_s, new_owner()
        self._loop: asyncio.Task[None] | None = None
        self.solves: dict[str, asyncio.Task[None]] = {}
        """Tasks solving them, by run id."""

    async def put(self, run: RunRecord, response: StoredResponse | None) -> StoredResponse | None:
        """Store a run leased by this process; see ``RunStore.put``."""
        return await self._store.put_leased(run, response, self._owner, self._lease_s)

    def follow(self, run_id: str, work: Coroutine[Any, Any, None], slot: contextlib.ExitStack) -> None:
        """Run the work on a run as a task; ``slot`` is closed when it ends."""
        task = self.solves[run_id] = asyncio.create_task(work)

        def ended(_task: asyncio.Task[None]) -> None:
            self.solves.pop(run_id, None)
            slot.close()

        task.add_done_callback(ended)

    def cancel(self, run_id: str) -> None:
        """Cancel the work on a run, if it is done in this process."""
        task = self.solves.get(run_id)
        if task is not None:
            task.cancel()

    def start(self, resume: Callable[[TakenOverRun], Coroutine[Any, Any, None]]) -> None:
        """Start renewing leases and taking over expired ones; ``resume`` returns the work on a run taken over."""
        self._loop = asyncio.create_task(self._renew_leases(resume))

    async def close(self) -> None:
        """Cancel all work and release the leases; the runs stay open for the next process."""
        tasks = [*self.solves.values(), *([self._loop] if self._loop else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        try:
            await self._store.write(ReleaseLeases(self._owner))
        except StoreError as error:  # the leases expire
            logger.warning("leases_not_released", reason=str(error))

    async def _renew_leases(self, resume: Callable[[TakenOverRun], Coroutine[Any, Any, None]]) -> None:
        while True:
            try:
                here = set(self.solves)
                held = await self._store.write(RenewLeases(self._owner, self._lease_s))
                for run_id in here - held:  # cancelled or taken over elsewhere
                    self.cancel(run_id)
                for taken in await self._store.write(TakeOverExpired(self._owner, self._lease_s, _MAX_TAKEN_OVER)):
                    self.follow(taken.run.id, resume(taken), contextlib.ExitStack())
            except StoreError as error:  # retried at the next interval
                logger.error("lease_renewal_failed", reason=str(error))
            await asyncio.sleep(self._lease_s / 4)
