"""What the batch engine costs beside the solves: chunks of 0.5 s that only sleep, on one and two workers.

An item sleeps 0.6 ms, so 833 of them make a chunk of 0.5 s; the batch of 20,000 takes one worker 12 s. Workers are
processes of this machine, or those of a Dask cluster on it: a scheduler, and workers of one thread, Dask's own, which
solve what the client asks.
Overhead is the part of the workers' time from the first lease to the last commit in which they did not sleep: leases,
dispatch, unpacking, storing, and the end of the batch, where one worker waits for the other. What solves cost the
processor is not in it: a machine whose cores are busy with other work measures nearly the same.

python -m bench engine_overhead
"""

from __future__ import annotations

import asyncio
import json
import pickle
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import nullcontext
from typing import Any

from app.batches import engine
from app.batches.service import Asked, BatchService
from app.batches.task import Solved, Task
from app.jobs.cluster import ClusterPool
from app.jobs.executor import PoolSettings, ProcessPool
from app.store.batch_inputs import unpacked_rows
from app.store.batch_items import packed, sealed
from app.store.batch_records import Item
from app.store.migrate import upgrade
from app.store.repository import RunStore
from bench.batch_rivals import DASK_WORKER, cluster

COUNT, ITEM_S = 20_000, 6e-4
_FIRST = 2000
"""Items of a batch before the measured one: it starts the workers."""


def answer(_kind: str, _mode: str, payload: bytes, _report: object) -> Solved:
    """Sleep as long as the chunk's items take, and answer them."""
    began = time.perf_counter()
    task: Task = pickle.loads(payload)
    rows = unpacked_rows(task.block, task.start, task.end)
    items = [
        Item(index, row.line, "succeeded", None, None, packed(b'{"result":{}}', task.dictionary))
        for index, row in enumerate(rows, task.first)
    ]
    time.sleep(max(0.0, ITEM_S * len(items) - (time.perf_counter() - began)))
    return Solved(sealed(task.batch, items), ITEM_S * len(items), ITEM_S * len(items))


def load(_kind: str, _mode: str) -> None:
    """Nothing to load."""


_SETTINGS: dict[str, Any] = {
    "entry": answer, "background_entry": answer, "load": load,
    "preload": "bench.engine_overhead", "kernels": False, "niceness": 0, "background_niceness": 0,
}  # fmt: skip


def overhead(workers: int, dask: bool) -> float:
    """The part of the workers' time that is not spent in chunks."""
    with tempfile.TemporaryDirectory() as folder, cluster(workers, DASK_WORKER) if dask else nullcontext("") as address:
        url = f"sqlite:///{folder}/runs.sqlite3"
        upgrade(url)
        return 1.0 - COUNT * ITEM_S / workers / asyncio.run(_taken(url, workers, address))


async def _taken(url: str, workers: int, address: str) -> float:
    if address:
        there = PoolSettings(workers=0, **_SETTINGS)
        pool: ProcessPool = ClusterPool(PoolSettings(workers=1, **_SETTINGS), address, there, None)
    else:
        pool = ProcessPool(PoolSettings(workers=1, background_workers=workers, **_SETTINGS))
    pool.start()
    while pool.background_workers < workers:
        await asyncio.sleep(0.1)
    try:
        with RunStore(url) as store:
            service = BatchService(store, pool, 10.0, 30.0)
            service.start()
            await _solved(service, _FIRST)
            taken = await _solved(service, COUNT)
            await service.close()
            return taken
    finally:
        pool.close()


async def _solved(service: BatchService, count: int) -> float:
    """Seconds from the first lease of a batch to its end."""

    async def rows() -> AsyncIterator[bytes]:
        yield b"{}\n" * count

    sent = json.loads(await service.take_lines(Asked("crank-masses", "analysis"), False, rows(), None))
    async for batch in service.progress(sent["id"], lambda: False):
        last = batch
    assert last.succeeded == count
    return (last.ended_at - last.started_at).total_seconds()


def table() -> list[str]:
    """Measure, as a table."""
    engine._INITIAL_ITEM_S = dict.fromkeys(engine._INITIAL_ITEM_S, ITEM_S)
    lines = ["| workers | overhead | two against one | goal |", "|---|---|---|---|"]
    for name, dask in (("process", False), ("Dask worker", True)):
        one, two = (overhead(workers, dask) for workers in (1, 2))
        plural = name + ("es" if name.endswith("s") else "s")
        lines.append(f"| one {name} | {100 * one:.1f} % | | ≤ 5 % |")
        lines.append(f"| two {plural} | {100 * two:.1f} % | {2 * (1 - two) / (1 - one):.2f} | ≤ 5 %, ≥ 1.7 |")
    return lines
