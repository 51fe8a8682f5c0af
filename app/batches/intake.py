"""Streaming intake of batches: rows are packed into blocks, and stored a few blocks at a time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

from app.errors import Problem
from app.store.batch_inputs import Row, packed_rows
from app.store.batch_operations import RECEIVING_S, Receive
from app.store.batch_records import Block
from app.store.repository import RunStore

_BLOCK_ROWS, _BLOCK_BYTES = 5000, 2 * 2**20
"""Block limits [rows, bytes]. A chunk lies in one block, so a block must hold a chunk of the fastest kind."""
_BLOCKS_PER_WRITE = 4
_LONGEST_REST_S = 0.1

_THREAD = ThreadPoolExecutor(1, thread_name_prefix="batch-intake")
T = TypeVar("T")


_waiting = 0


async def aside(call: Callable[[], T]) -> T:
    """Run a call on the one thread for incoming rows.

    However many batches arrive at once, they take no more of the service's time from other requests than one of them;
    and a third of that where several do, since the thread then rests twice as long as it worked.
    """
    global _waiting
    _waiting += 1
    try:
        return await asyncio.get_running_loop().run_in_executor(_THREAD, _then_rest, call)
    finally:
        _waiting -= 1


def _then_rest(call: Callable[[], T]) -> T:
    started = time.monotonic()
    try:
        return call()
    finally:
        if _waiting > 1:
            time.sleep(min(2.0 * (time.monotonic() - started), _LONGEST_REST_S))


class Receiver:
    """Stores rows as blocks of one batch, a few blocks per transaction, with memory bounded by these blocks.

    ``writing`` is shared by all batches of a service: a commit contains the blocks of one of them, so that the other
    writes of its group do not wait long.
    """

    def __init__(self, store: RunStore, number: int, writing: asyncio.Lock) -> None:
        self._store, self._number, self._writing = store, number, writing
        self._rows: list[Row] = []
        self._bytes = 0
        self._blocks: list[Block] = []
        self._packed = 0
        self._written = time.monotonic()
        self.total = 0

    async def add(self, rows: Sequence[Row]) -> None:
        """Append rows; may store full blocks."""
        for row in rows:
            self._rows.append(row)
            self._bytes += len(row.content)
            if len(self._rows) >= _BLOCK_ROWS or self._bytes >= _BLOCK_BYTES:
                await self._pack()
        self.total = self._packed + len(self._rows)
        if time.monotonic() - self._written > RECEIVING_S / 4:
            await self.finish()

    async def finish(self) -> None:
        """Store the remaining rows."""
        await self._pack()
        await self._write()
        self.total = self._packed

    async def _pack(self) -> None:
        rows, self._rows, self._bytes = self._rows, [], 0
        if not rows:
            return
        content = await aside(lambda: packed_rows(rows))
        self._blocks.append(Block(self._packed, len(rows), content))
        self._packed += len(rows)
        if len(self._blocks) >= _BLOCKS_PER_WRITE:
            await self._write()

    async def _write(self) -> None:
        blocks, self._blocks, self._written = tuple(self._blocks), [], time.monotonic()
        if not blocks:
            return
        async with self._writing:
            kept = await self._store.write(Receive(self._number, blocks))
        if not kept:
            raise Problem(408, "The batch took too long", "no row came for so long that the batch was given up")


async def in_slices(rows: Iterator[Row], count: int = 1000) -> AsyncIterator[list[Row]]:
    """Generated rows in slices of ``count``."""
    while found := await aside(lambda: list(islice(rows, count))):
        yield found
