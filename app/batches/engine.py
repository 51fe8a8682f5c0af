"""The engine: leases chunks of the active batches, has them solved, and stores every answer exactly once.

It may lose anything at any moment: what it holds is leased for a short time only, and what it has stored is stored in
one transaction with the chunk's mark.
"""

from __future__ import annotations

import asyncio
import math
import pickle
import time
from collections import OrderedDict
from dataclasses import replace
from typing import Any

from app import runs
from app.batches.chunk import failed_item, parts_of
from app.batches.task import Needs, Task
from app.designs.accuracy import MAX_BUDGET_S
from app.designs.kind import Detail, Mode
from app.designs.many import without_tables
from app.designs.problems import OUT_OF_TIME
from app.designs.registry import KINDS, example_of, job_of
from app.jobs.errors import BudgetExceeded, Busy, ExecutorClosed, JobError, MemoryExceeded, WorkerCrashed
from app.jobs.executor import Executor
from app.logging import get_logger
from app.store.batch_inputs import Source, unpacked_rows
from app.store.batch_items import encoded
from app.store.batch_operations import Claim, DropAbandoned, Finish, Release, Renew, Return, Split
from app.store.batch_reads import active_batches, block_of, items_asking
from app.store.batch_records import BatchRecord, Chunk, Item
from app.store.errors import StoreError, UnknownRun
from app.store.hashing import canonical_json
from app.store.leases import LEASE_S, new_owner
from app.store.repository import RunStore
from app.store.viewer import seeing_as

logger = get_logger(__name__)

_CHUNK_S = 0.5
"""What a chunk is to take: long against storing it, short against a person's patience."""
_FIRST_GUESS_S = {Mode.CHECK: 2e-3, Mode.ANALYSIS: 2e-2, Mode.DESIGN: 0.2, Mode.ACCURACY: 5.0}
_LOOK_S = 0.5
_MOST_CRASHES = 3
"""So often a chunk of several items may come to no end before it is split."""
_MOST_CRASHES_ALONE = 6
"""So often one item; the death of a service that had leased it counts too."""
_MOST_ATTEMPTS = 20
"""So often a chunk may be leased, as often as an accepted run: who leases it may be killed through no fault of it."""
_BLOCKS_KEPT = 8
_WORTH_A_LOOK_S = 5e-3
"""Items that take longer than this are looked for among those of other chunks before they are solved."""
_LONGEST_DICTIONARY = 32_000
"""More a deflated text cannot look back."""


class BatchEngine:
    """Works on the batches of one store until it is closed; several processes may do so at once."""

    def __init__(self, store: RunStore, executor: Executor, solve_budget_s: float, lease_s: float = LEASE_S) -> None:
        self._store, self._executor, self._solve_budget_s = store, executor, solve_budget_s
        self._lease_s = lease_s
        self.owner = new_owner()
        self._wake = asyncio.Event()
        self._tasks: dict[asyncio.Task[None], int] = {}
        self._solving: dict[tuple[int, int], asyncio.Task[None]] = {}
        """Which task solves what is asked, of batches whose items are worth a look for equal ones."""
        self._item_s: dict[tuple[str, str, str], float] = {}
        self._blocks: OrderedDict[tuple[int, int], bytes] = OrderedDict()
        self._dictionaries: dict[tuple[str, str, str], bytes] = {}
        self._turn = 0
        self._loop: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin; returns at once."""
        if self._executor.background_workers:
            self._loop = asyncio.create_task(self._run())

    def look(self) -> None:
        """There may be something new to do."""
        self._wake.set()

    def cancel(self, number: int) -> None:
        """End what is being solved of a batch that was cancelled in the store."""
        for task, batch in list(self._tasks.items()):
            if batch == number:
                task.cancel()

    async def close(self) -> None:
        """End every solve and give back what is leased."""
        if self._loop is None:
            return
        tasks = [self._loop, *self._tasks]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        try:
            await self._store.write(Release(self.owner))
        except StoreError as error:  # the leases run out by themselves
            logger.warning("leases_not_released", reason=str(error))

    async def dictionary(self, kind: str, mode: str, detail: str) -> bytes:
        """Text that the items of such a batch resemble; empty where it cannot be had soon, which only costs room."""
        key = (kind, mode, detail)
        if key not in self._dictionaries:
            wing, example = KINDS[kind], example_of(KINDS[kind], Mode(mode))
            if mode == Mode.ACCURACY:  # a study takes longer than its answer is worth here
                return canonical_json(example)
            try:
                payload = canonical_json(example)
                found = await self._executor.run(kind, mode, payload, self._solve_budget_s)
            except JobError:
                return b""
            kept = without_tables(job_of(wing, Mode(mode)), found, Detail(detail))
            spec = job_of(wing, Mode(mode)).request.model_validate(example).model_dump_json().encode()
            text = encoded(spec, parts_of(kind, Mode(mode), kept))
            self._dictionaries[key] = text[:_LONGEST_DICTIONARY]
        return self._dictionaries[key]

    async def _run(self) -> None:
        renewed = swept = -self._lease_s
        while True:
            try:
                if time.monotonic() - renewed > self._lease_s / 4:
                    renewed = time.monotonic()
                    if self._tasks:
                        await self._store.write(Renew(self.owner, self._lease_s))
                if time.monotonic() - swept > 4 * self._lease_s:
                    swept = time.monotonic()
                    await self._store.write(DropAbandoned())
                claimed = await self._claim()
            except asyncio.CancelledError:
                raise
            except Exception:  # a database in trouble: everything waits until it is well again
                logger.exception("batch_engine_stumbled")
                claimed = False
            if not claimed:
                self._wake.clear()
                try:
                    await asyncio.wait_for(self._wake.wait(), min(_LOOK_S, self._lease_s / 4))
                except TimeoutError:
                    continue

    @property
    def _room(self) -> int:
        """How many chunks more to hold: for every worker one that runs and one that follows it at once."""
        return 2 * self._executor.background_workers - len(self._tasks)

    async def _claim(self) -> bool:
        """Lease chunks of one batch, the batches taking turns; whether there were any."""
        if self._room <= 0:
            return False
        active = await self._store.query(active_batches)
        for offset in range(len(active)):
            self._turn += 1
            batch = active[(self._turn + offset) % len(active)]
            share = self._room if len(active) == 1 else 1
            claim = Claim(batch.number, self.owner, self._lease_s, share, self._items_of(batch))
            chunks = await self._store.write(claim)
            for chunk in chunks:
                self._begin(batch, chunk)
            if chunks:
                return True
        return False

    def _items_of(self, batch: BatchRecord) -> int:
        """Items of a chunk; a small batch still has a chunk for each worker."""
        share = math.ceil(batch.total / max(1, self._executor.background_workers))
        return max(1, min(int(_CHUNK_S / self._guess(batch)), share))

    def _guess(self, batch: BatchRecord) -> float:
        """About how long an item takes [s]."""
        return self._item_s.get((batch.kind, batch.mode, batch.detail), _FIRST_GUESS_S[Mode(batch.mode)])

    def _begin(self, batch: BatchRecord, chunk: Chunk) -> None:
        task = asyncio.create_task(self._do(batch, chunk))
        self._tasks[task] = batch.number
        task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.pop(task, None)
        self._solving = {asked: other for asked, other in self._solving.items() if other is not task}
        self._wake.set()
        if not task.cancelled() and task.exception() is not None:
            # The lease runs out, and the chunk is taken again.
            logger.error("batch_chunk_lost", reason=repr(task.exception()))

    async def _do(self, batch: BatchRecord, chunk: Chunk) -> None:
        if chunk.attempts > _MOST_CRASHES and chunk.count > 1:
            await self._store.write(Split(chunk, self.owner))
            return
        if chunk.attempts > _MOST_ATTEMPTS:
            await self._give_up(batch, chunk, 500, "The solver failed", f"{_MOST_ATTEMPTS} attempts came to no end")
            return
        try:
            items = await self._solve(batch, chunk)
        except ExecutorClosed:
            return
        except Busy:
            await asyncio.sleep(_LOOK_S)
            await self._store.write(Return(chunk, self.owner, in_vain=False))
        except JobError as error:
            await self._recover(batch, chunk, error)
        else:
            await self._store.write(Finish(chunk, self.owner, tuple(items)))

    async def _solve(self, batch: BatchRecord, chunk: Chunk) -> list[Item]:
        block = await self._block(chunk)
        start = chunk.first - chunk.block
        task = Task(
            batch.source,
            block,
            start,
            start + chunk.count,
            chunk.first,
            batch.detail,
            batch.dictionary,
            self._solve_budget_s,
            self._guess(batch) > _WORTH_A_LOOK_S,
        )
        kill_s = self._solve_budget_s + 10 * self._guess(batch) * chunk.count
        if batch.mode == Mode.ACCURACY:
            kill_s += MAX_BUDGET_S * chunk.count
        while True:
            found = await self._executor.run_in_background(batch.kind, batch.mode, pickle.dumps(task), kill_s)
            if not isinstance(found, Needs):
                self._learn(batch, found.seconds / chunk.count)
                return found.items
            if found.run_ids:
                task = replace(task, runs={**task.runs, **await self._runs(found, batch.owner)})
            else:
                task = replace(task, known=await self._equal(batch, found.asked))

    async def _equal(self, batch: BatchRecord, asked: frozenset[int]) -> dict[int, Item]:
        """Stored items of a batch that ask one of these, after those that are being solved here have ended.

        Whoever waits has not yet said what it solves itself, so no two wait for each other.
        """
        while others := {self._solving[batch.number, each] for each in asked if (batch.number, each) in self._solving}:
            await asyncio.wait(others)
        own = asyncio.current_task()
        assert own is not None
        self._solving.update(((batch.number, each), own) for each in asked)
        return await self._store.query(lambda connection: items_asking(connection, batch.number, asked))

    def _learn(self, batch: BatchRecord, seconds: float) -> None:
        key = (batch.kind, batch.mode, batch.detail)
        self._item_s[key] = 0.5 * self._item_s.get(key, seconds) + 0.5 * max(seconds, 1e-6)

    async def _runs(self, needs: Needs, owner: str | None) -> dict[str, bytes | None]:
        found: dict[str, bytes | None] = {}
        for run_id in needs.run_ids:
            try:
                with seeing_as(owner):
                    found[run_id] = runs.run_json(await self._store.get(run_id))
            except UnknownRun:
                found[run_id] = None
        return found

    async def _block(self, chunk: Chunk) -> bytes:
        key = (chunk.batch, chunk.block)
        if key not in self._blocks:
            self._blocks[key] = await self._store.query(lambda connection: block_of(connection, *key))
            while len(self._blocks) > _BLOCKS_KEPT:
                self._blocks.popitem(last=False)
        return self._blocks[key]

    async def _recover(self, batch: BatchRecord, chunk: Chunk, error: JobError) -> None:
        """The chunk brought its worker down, or took too long."""
        logger.warning("batch_chunk_failed", batch=batch.id, first=chunk.first, count=chunk.count, reason=str(error))
        if isinstance(error, BudgetExceeded):
            self._item_s[batch.kind, batch.mode, batch.detail] = 4 * self._guess(batch)
        if chunk.count > 1:
            await self._store.write(Split(chunk, self.owner))
        elif isinstance(error, WorkerCrashed) and chunk.attempts < _MOST_CRASHES_ALONE:
            await self._store.write(Return(chunk, self.owner, in_vain=True))
        else:
            await self._give_up(batch, chunk, *_words(error))

    async def _give_up(self, batch: BatchRecord, chunk: Chunk, status: int, title: str, detail: str) -> None:
        """Store the only item of the chunk as failed."""
        start = chunk.first - chunk.block
        source = Source.from_json(batch.source)
        rows = unpacked_rows(await self._block(chunk), start, start + chunk.count)
        items: list[Any] = [
            failed_item(index, row, source, batch.dictionary, status, title, detail)
            for index, row in enumerate(rows, chunk.first)
        ]
        await self._store.write(Finish(chunk, self.owner, tuple(items)))


def _words(error: JobError) -> tuple[int, str, str]:
    if isinstance(error, BudgetExceeded):
        return 504, OUT_OF_TIME, str(error)
    if isinstance(error, MemoryExceeded):
        return 507, "The memory bound was reached", str(error)
    return 500, "The solver failed", "the solve ended without an answer"
