"""Subprocess that processes the batches of a database with fake workers."""

from __future__ import annotations

import asyncio
import sys

from app.batches.service import BatchService
from app.jobs.executor import PoolSettings, ProcessPool
from app.store.repository import RunStore
from tests.app.batches.fake_worker import answer, load


def pool(workers: int = 2) -> ProcessPool:
    return ProcessPool(
        PoolSettings(
            workers=1,
            entry=answer,
            load=load,
            preload="tests.app.batches.fake_worker",
            kernels=False,
            background_workers=workers,
            background_entry=answer,
            niceness=0,
            background_niceness=0,
        )
    )


async def work(url: str, lease_s: float) -> None:
    """Run until killed."""
    executor = pool()
    executor.start()
    with RunStore(url) as store:
        service = BatchService(store, executor, 2.0, lease_s)
        service.start()
        print("working", flush=True)
        await asyncio.Event().wait()


def main() -> None:
    asyncio.run(work(sys.argv[1], float(sys.argv[2])))
