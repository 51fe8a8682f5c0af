"""Batch engine: leases chunks of the active batches, dispatches them to workers, stores every answer exactly once.

The engine tolerates a crash at any point: leases expire, and the items of a chunk are committed in the same transaction
as its state.
"""

from __future__ import annotations

import asyncio
import math
import pickle
import time
from collections import OrderedDict
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

from pydantic import BaseModel

from app import metrics, runs
from app.batches.chunk import failed_item, parts_of
from app.batches.task import Needs, Task
from app.designs.accuracy import MAX_BUDGET_S
from app.designs.kind import Detail, Mode
from app.designs.many import validated, without_tables
from app.designs.problems import SOLVER_FAILED
from app.designs.registry import KINDS, example_of, job_of
from app.jobs.errors import BudgetExceeded, Busy, ExecutorClosed, JobError, WorkerCrashed
from app.jobs.executor import Executor
from app.jobs.turns import Turns
from app.logging import get_logger
from app.solve_failures import problem_of
from app.store.batch_inputs import Row, Source, UnreadableRow, unpacked_rows
from app.store.batch_items import encoded, sealed
from app.store.batch_operations import Claim, DropAbandoned, Finish, Release, Renew, Return, Split
from app.store.batch_reads import batches_to_solve, block_of, items_asking, numbered_batch
from app.store.batch_records import BatchRecord, Chunk, Item
from app.store.errors import StoreError, UnknownRun
from app.store.hashing import canonical_json
from app.store.leases import LEASE_S, new_owner
from app.store.repository import RunStore
from app.store.viewer import seeing_as

logger = get_logger(__name__)

_CHUNK_TARGET_S, _CHUNK_LIMIT_S = 0.5, 5.0
"""Target of a chunk's processor time [s], long compared with what its lease and commit take, and limit of the time it
waits for the processor as well, which a user sees."""
_INITIAL_ITEM_S = {Mode.CHECK: 2e-3, Mode.ANALYSIS: 2e-2, Mode.DESIGN: 0.2, Mode.ACCURACY: 5.0}
_POLL_INTERVAL_S, _IDLE_POLL_INTERVAL_S = 0.5, 2.0
"""Time between looks for chunks that others have left [s], while some are solved here and while none are. A batch sent
to this process is seen at once."""
_MAX_CRASHES = 3
"""Maximum attempts of a chunk of several items before it is split."""
_MAX_ITEM_CRASHES = 6
"""Maximum attempts of a single item that crashes its worker; the death of a service that held its lease counts too."""
_MAX_ATTEMPTS = 20
"""Maximum leases of a chunk, as for an accepted run: the lease holder may be killed through no fault of the chunk."""
_MAX_CACHED_BLOCKS, _MAX_CACHED_BATCHES = 8, 64
_LOOKUP_THRESHOLD_S = 5e-3
"""Item solve time [s] above which equal items of other chunks are looked up before solving."""
_MAX_DICTIONARY_BYTES = 32_000
"""The window of DEFLATE [bytes]."""
_DICTIONARY_S = 2.0
"""Maximum time [s] that intake waits for a dictionary: usually milliseconds, but not while all workers are busy."""


class _ItemTime(NamedTuple):
    """Estimated time of an item [s]: from its start to its end, and of the processor.

    On a busy machine, batches wait for the processor most of the time. Chunks measured by the clock alone would become
    small there, and make it busier by what each chunk takes.
    """

    elapsed_s: float
    processor_s: float

    def times(self, factor: float) -> _ItemTime:
        return _ItemTime(factor * self.elapsed_s, factor * self.processor_s)

    def between(self, other: _ItemTime) -> _ItemTime:
        """The mean of both, at least a microsecond."""
        return _ItemTime(*(max(1e-6, 0.5 * (own + its)) for own, its in zip(self, other, strict=True)))


class BatchEngine:
    """Processes the batches of one store until closed; several processes may share a store."""

    def __init__(self, store: RunStore, executor: Executor, solve_budget_s: float, lease_s: float = LEASE_S) -> None:
        self._store, self._executor, self._solve_budget_s = store, executor, solve_budget_s
        self._lease_s = lease_s
        self.owner = new_owner()
        self._wake = asyncio.Event()
        self._tasks: dict[asyncio.Task[None], int] = {}
        self._solving: dict[tuple[int, int], asyncio.Task[None]] = {}
        """The task that solves each (batch, request number), for batches whose equal items are looked up."""
        self._item_s: dict[tuple[str, str, str], _ItemTime] = {}
        self._blocks: OrderedDict[tuple[int, int], bytes] = OrderedDict()
        self._dictionaries: dict[tuple[str, str, str], bytes] = {}
        self._preparing: dict[tuple[str, str, str], asyncio.Task[bytes]] = {}
        self._owners: Turns[str | None] = Turns()
        self._batches: Turns[int] = Turns()
        self._records: OrderedDict[int, BatchRecord] = OrderedDict()
        self._loop: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Start the background loop; does not block."""
        if self._executor.background_workers:
            self._loop = asyncio.create_task(self._run())

    def look(self) -> None:
        """Wake the loop: new work may be available."""
        self._wake.set()

    def cancel(self, number: int) -> None:
        """Cancel the running solves of a batch already cancelled in the store."""
        for task, batch in list(self._tasks.items()):
            if batch == number:
                task.cancel()

    async def close(self) -> None:
        """Cancel every solve and release all leases."""
        for preparing in list(self._preparing.values()):
            preparing.cancel()
        if self._loop is None:
            return
        tasks = [self._loop, *self._tasks]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        try:
            await self._store.write(Release(self.owner))
        except StoreError as error:  # the leases expire on their own
            logger.warning("leases_not_released", reason=str(error))

    async def dictionary(self, kind: str, mode: str, detail: str, source: Source, first: Row | None) -> bytes:
        """Compression dictionary for the items of a batch: its ``first`` item, from which most others differ in their
        numbers only, or else the kind's example; without an answer in time the example's request, which only costs
        space."""
        job, example = job_of(KINDS[kind], Mode(mode)), example_of(KINDS[kind], Mode(mode))
        with suppress(TimeoutError):
            async with asyncio.timeout(_DICTIONARY_S):
                if job.run_many is not None and first is not None and len(first.content) <= _MAX_DICTIONARY_BYTES:
                    with suppress(UnreadableRow, RecursionError):
                        request, _ = validated(job, source.body(first))
                        if request is not None and (found := await self._item(kind, mode, detail, request)):
                            return found
                if mode != Mode.ACCURACY:  # a study is too expensive for a dictionary
                    return await self._example(kind, mode, detail, job.request.model_validate(example))
        return canonical_json(example)

    async def _example(self, kind: str, mode: str, detail: str, request: BaseModel) -> bytes:
        """The solved example as an item. Its solve goes on if nobody waits for it any longer: later batches use it."""
        key = (kind, mode, detail)
        if key not in self._dictionaries:
            if key not in self._preparing:
                self._preparing[key] = task = asyncio.create_task(self._item(kind, mode, detail, request))
                task.add_done_callback(lambda _: self._preparing.pop(key))
            if not (found := await asyncio.shield(self._preparing[key])):
                return b""
            self._dictionaries[key] = found
        return self._dictionaries[key]

    async def _item(self, kind: str, mode: str, detail: str, request: BaseModel) -> bytes:
        """A solved request as the JSON of an item, cut to the window of DEFLATE; empty without an answer."""
        spec = request.model_dump_json().encode()
        try:
            found = (await self._executor.run(kind, mode, spec, self._solve_budget_s)).decoded()
        except JobError:
            return b""
        kept = without_tables(job_of(KINDS[kind], Mode(mode)), found, Detail(detail))
        return encoded(spec, parts_of(kind, Mode(mode), kept))[:_MAX_DICTIONARY_BYTES] if kept.result else b""

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
            except Exception:  # database failure: retry until it recovers
                logger.exception("batch_engine_stumbled")
                claimed = False
            if not claimed:
                self._wake.clear()
                pause_s = _POLL_INTERVAL_S if self._tasks else _IDLE_POLL_INTERVAL_S
                try:
                    await asyncio.wait_for(self._wake.wait(), min(pause_s, self._lease_s / 4))
                except TimeoutError:
                    continue

    @property
    def _capacity(self) -> int:
        """Number of further chunks to lease: per worker, one running and one queued behind it."""
        return 2 * self._executor.background_workers - len(self._tasks)

    async def _claim(self) -> bool:
        """Lease chunks of one batch; False if none was available. Owners take turns, and so do the batches of each."""
        if self._capacity <= 0:
            return False
        waiting = await self._store.query(batches_to_solve)
        share = self._capacity if len(waiting) == 1 else 1
        while waiting:
            owner = self._owners.next(owner for owner, _ in waiting)
            number = self._batches.next(number for other, number in waiting if other == owner)
            batch = await self._record(number)
            most = 1.0 / (2 * self._executor.background_workers)
            claim = Claim(number, self.owner, self._lease_s, share, self._items_of(batch), most)
            chunks = await self._store.write(claim)
            for chunk in chunks:
                self._launch(batch, chunk)
            if chunks:
                self._owners.served(owner)
                self._batches.served(number)
                return True
            waiting.remove((owner, number))  # another process was faster
        return False

    async def _record(self, number: int) -> BatchRecord:
        """A batch as it was when first claimed; what its chunks need does not change."""
        if number not in self._records:
            self._records[number] = await self._store.query(lambda connection: numbered_batch(connection, number))
            while len(self._records) > _MAX_CACHED_BATCHES:
                self._records.popitem(last=False)
        return self._records[number]

    def _items_of(self, batch: BatchRecord) -> int:
        """Items of a chunk; a small batch still has a chunk for each worker."""
        share = math.ceil(batch.total / self._executor.background_workers)
        time = self._estimated_item_time(batch)
        return max(1, min(int(_CHUNK_TARGET_S / time.processor_s), int(_CHUNK_LIMIT_S / time.elapsed_s), share))

    def _estimated_item_time(self, batch: BatchRecord) -> _ItemTime:
        first = _INITIAL_ITEM_S[Mode(batch.mode)]
        return self._item_s.get((batch.kind, batch.mode, batch.detail), _ItemTime(first, first))

    def _launch(self, batch: BatchRecord, chunk: Chunk) -> None:
        task = asyncio.create_task(self._process(batch, chunk))
        self._tasks[task] = batch.number
        task.add_done_callback(self._on_done)

    def _on_done(self, task: asyncio.Task[None]) -> None:
        self._tasks.pop(task, None)
        self._solving = {asked: other for asked, other in self._solving.items() if other is not task}
        self._wake.set()
        if not task.cancelled() and task.exception() is not None:
            # The lease expires, and the chunk is claimed again.
            logger.error("batch_chunk_lost", reason=repr(task.exception()))

    async def _process(self, batch: BatchRecord, chunk: Chunk) -> None:
        if chunk.attempts > _MAX_CRASHES and chunk.count > 1:
            await self._store.write(Split(chunk, self.owner))
            return
        if chunk.attempts > _MAX_ATTEMPTS:
            await self._give_up(batch, chunk, 500, SOLVER_FAILED, f"{_MAX_ATTEMPTS} attempts came to no end")
            return
        try:
            items = await self._solve(batch, chunk)
        except ExecutorClosed:
            return
        except Busy:
            await asyncio.sleep(_POLL_INTERVAL_S)
            await self._store.write(Return(chunk, self.owner, in_vain=False))
        except JobError as error:
            await self._recover(batch, chunk, error)
        else:
            await self._finish(batch, chunk, items)

    async def _finish(self, batch: BatchRecord, chunk: Chunk, items: bytes) -> None:
        if counted := await self._store.write(Finish(chunk, self.owner, items)):
            metrics.record_items(batch.kind, batch.mode, counted)

    async def _solve(self, batch: BatchRecord, chunk: Chunk) -> bytes:
        """The chunk's items, ``sealed``."""
        block = await self._block(chunk)
        start = chunk.first - chunk.block
        task = Task(
            batch.number,
            batch.source,
            block,
            start,
            start + chunk.count,
            chunk.first,
            batch.detail,
            batch.dictionary,
            self._solve_budget_s,
            self._estimated_item_time(batch).processor_s > _LOOKUP_THRESHOLD_S,
        )
        kill_s = self._solve_budget_s + 10 * self._estimated_item_time(batch).elapsed_s * chunk.count
        if batch.mode == Mode.ACCURACY:
            kill_s += MAX_BUDGET_S * chunk.count
        while True:
            found = await self._executor.run_in_background(batch.kind, batch.mode, pickle.dumps(task), kill_s)
            if not isinstance(found, Needs):
                self._update_estimate(batch, _ItemTime(found.seconds, found.processor_s).times(1.0 / chunk.count))
                return found.items
            if found.run_ids:
                task = replace(task, runs={**task.runs, **await self._runs(found, batch.owner)})
            else:
                task = replace(task, known=await self._equal_items(batch, found.asked))

    async def _equal_items(self, batch: BatchRecord, asked: frozenset[int]) -> dict[int, Item]:
        """Stored items of a batch equal to the requested ones, after the local solves of such items have finished.

        Deadlock-free: a task registers its own requests only after its wait.
        """
        while others := {self._solving[batch.number, each] for each in asked if (batch.number, each) in self._solving}:
            await asyncio.wait(others)
        own = asyncio.current_task()
        assert own is not None
        self._solving.update(((batch.number, each), own) for each in asked)
        return await self._store.query(lambda connection: items_asking(connection, batch.number, asked))

    def _update_estimate(self, batch: BatchRecord, found: _ItemTime) -> None:
        key = (batch.kind, batch.mode, batch.detail)
        self._item_s[key] = self._item_s.get(key, found).between(found)

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
            while len(self._blocks) > _MAX_CACHED_BLOCKS:
                self._blocks.popitem(last=False)
        return self._blocks[key]

    async def _recover(self, batch: BatchRecord, chunk: Chunk, error: JobError) -> None:
        """Handle a chunk that crashed its worker or exceeded its budget: split, retry or fail it."""
        logger.warning("batch_chunk_failed", batch=batch.id, first=chunk.first, count=chunk.count, reason=str(error))
        if isinstance(error, BudgetExceeded):
            self._item_s[batch.kind, batch.mode, batch.detail] = self._estimated_item_time(batch).times(4.0)
        if chunk.count > 1:
            await self._store.write(Split(chunk, self.owner))
        elif isinstance(error, WorkerCrashed) and chunk.attempts < _MAX_ITEM_CRASHES:
            await self._store.write(Return(chunk, self.owner, in_vain=True))
        else:
            await self._give_up(batch, chunk, *problem_of(error))

    async def _give_up(self, batch: BatchRecord, chunk: Chunk, status: int, title: str, detail: str) -> None:
        """Store the single item of the chunk as failed."""
        start = chunk.first - chunk.block
        source = Source.from_json(batch.source)
        rows = unpacked_rows(await self._block(chunk), start, start + chunk.count)
        items = [
            failed_item(index, row, source, batch.dictionary, status, title, detail)
            for index, row in enumerate(rows, chunk.first)
        ]
        await self._finish(batch, chunk, sealed(batch.number, items))
