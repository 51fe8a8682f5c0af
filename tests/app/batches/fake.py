"""A worker that only pretends to solve, and a process that works on the batches of a database with it.

What a row says happens: {"do": "die"} ends the worker, "hang" never ends, "die once" ends it as long as the file that
the row names is not there.
"""

from __future__ import annotations

import asyncio
import os
import pickle
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from app.batches.chunk import Solved, Task
from app.batches.service import BatchService
from app.designs.progress import Report
from app.jobs.executor import PoolSettings, ProcessPool
from app.store.batch_inputs import Source, unpacked_rows
from app.store.batch_items import packed
from app.store.batch_records import Item
from app.store.repository import RunStore

ITEM_S = 2e-4


def load(_kind: str, _mode: str) -> None:
    """Nothing is needed."""


def nothing() -> Iterator[None]:
    return iter(())


def load_step_by_step() -> Iterator[None]:
    return iter(())


def answer(_kind: str, _mode: str, payload: bytes, _report: Report) -> Solved:
    task: Task = pickle.loads(payload)
    source, items = Source.from_json(task.source), []
    for index, row in enumerate(unpacked_rows(task.block, task.start, task.end), task.first):
        body = source.body(row)
        if body.get("do") == "die" or (body.get("do") == "die once" and not Path(body["file"]).exists()):
            if "file" in body:
                Path(body["file"]).touch()
            os._exit(3)
        if body.get("do") == "hang":
            time.sleep(1000)
        parts = {"spec": body, "result": {"x": index}}
        items.append(Item(index, row.line, "succeeded", None, None, packed(parts, task.dictionary)))
    time.sleep(ITEM_S * len(items))
    return Solved(items, ITEM_S * len(items))


def pool(workers: int = 2) -> ProcessPool:
    return ProcessPool(
        PoolSettings(
            workers=1,
            entry=answer,
            load=load,
            idle_work=nothing,
            preload="tests.app.batches.fake",
            kernels=False,
            background_workers=workers,
            background_entry=answer,
            niceness=0,
            background_niceness=0,
        )
    )


async def work(url: str, lease_s: float) -> None:
    """Until killed."""
    executor = pool()
    executor.start()
    with RunStore(url) as store:
        service = BatchService(store, executor, 2.0, lease_s)
        service.start()
        print("working", flush=True)
        await asyncio.Event().wait()


def main() -> None:
    asyncio.run(work(sys.argv[1], float(sys.argv[2])))
