"""The runs that were promised by a 202: each is worked on by one process, and taken over by another when that dies."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Coroutine
from typing import Any

from app.logging import get_logger
from app.store.errors import StoreError
from app.store.leases import LEASE_S, new_owner
from app.store.promises import HoldOn, LetGo, TakenOver, TakeOver
from app.store.record import RunRecord, StoredResponse
from app.store.repository import RunStore

logger = get_logger(__name__)

MOST_ATTEMPTS = 20
"""So often the solve of a run may be begun whose service process died each time. It hardly dies of the run, which is
solved in a worker."""
_MOST_AT_ONCE = 20
"""So many one process takes over at one look: others may have room too."""


class Promises:
    """What this process has promised or taken over, and the leases on it; belongs to one event loop."""

    def __init__(self, store: RunStore, lease_s: float = LEASE_S) -> None:
        self._store, self._lease_s, self._owner = store, lease_s, new_owner()
        self._loop: asyncio.Task[None] | None = None
        self.solves: dict[str, asyncio.Task[None]] = {}
        """What works on them, by the id of the run."""

    async def put(self, run: RunRecord, response: StoredResponse | None) -> StoredResponse | None:
        """Store a run as promised by this process; what ``RunStore.put`` returns."""
        return await self._store.promise(run, response, self._owner, self._lease_s)

    def follow(self, run_id: str, work: Coroutine[Any, Any, None], place: contextlib.ExitStack) -> None:
        """Let the work on a run go on by itself; ``place`` is closed when it ends."""
        task = self.solves[run_id] = asyncio.create_task(work)

        def ended(_task: asyncio.Task[None]) -> None:
            self.solves.pop(run_id, None)
            place.close()

        task.add_done_callback(ended)

    def cancel(self, run_id: str) -> None:
        """End the work on a run, if it is done here."""
        task = self.solves.get(run_id)
        if task is not None:
            task.cancel()

    def start(self, take_up: Callable[[TakenOver], Coroutine[Any, Any, None]]) -> None:
        """Begin to hold leases, and to take over what others leave: ``take_up`` gives the work on such a run."""
        self._loop = asyncio.create_task(self._hold(take_up))

    async def close(self) -> None:
        """End the work on all of them and give back the leases: the runs stay open for the next process."""
        tasks = [*self.solves.values(), *([self._loop] if self._loop else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        try:
            await self._store.write(LetGo(self._owner))
        except StoreError as error:  # the leases run out by themselves
            logger.warning("leases_not_released", reason=str(error))

    async def _hold(self, take_up: Callable[[TakenOver], Coroutine[Any, Any, None]]) -> None:
        while True:
            try:
                here = set(self.solves)
                held = await self._store.write(HoldOn(self._owner, self._lease_s))
                for run_id in (
                    here - held
                ):  # cancelled by another process, or taken over after a long silence of this one
                    self.cancel(run_id)
                for taken in await self._store.write(TakeOver(self._owner, self._lease_s, _MOST_AT_ONCE)):
                    self.follow(taken.run.id, take_up(taken), contextlib.ExitStack())
            except StoreError as error:  # a database in trouble: all wait until it is well again
                logger.error("promises_not_held", reason=str(error))
            await asyncio.sleep(self._lease_s / 4)
