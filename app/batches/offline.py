"""Batches of the command line solved by its own workers."""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.batches.case_files import CSV, FORMATS, PARQUET, READ_BYTES, SWEEP, form_of, keys_of, replacing, swept
from app.batches.results import Wanted
from app.batches.service import Asked, BatchService
from app.batches.sweep import Sweep
from app.batches.view import batch_json
from app.batches.workers import chunk_workers
from app.jobs.executor import ProcessPool
from app.settings import Settings
from app.store.batch_records import BatchRecord, BatchStatus
from app.store.migrate import upgrade
from app.store.repository import RunStore


async def here(
    file: Path,
    kind: str,
    mode: str,
    detail: str,
    output: Path,
    database_url: str,
    workers: int,
    told: Callable[[dict[str, Any]], None],
) -> dict[str, Any]:
    """Solve a batch with local workers and write ``output``; returns the finished batch, which is a resumed one unless
    that was cancelled. ``told`` is called with the batch after each change. Raises Problem."""
    limits = Settings(batch_workers=workers)
    upgrade(database_url)
    # An interactive worker, too: kernels are loaded for all once it serves.
    pool = ProcessPool(replace(chunk_workers(limits), workers=1))
    pool.start()
    try:
        with RunStore(database_url) as store:
            service = BatchService(store, pool, limits.solve_budget_s, limits.lease_s, limits.max_batch_items)
            ask = Asked.of(kind, mode, file.name, detail)
            for key in keys_of(file, kind, mode, detail):
                taken = await _taken(service, ask, file, key)
                if taken.status != BatchStatus.CANCELLED:
                    break
            service.start()
            try:
                async for batch in service.progress(taken.id, lambda: False):
                    told(batch_json(batch))
                with replacing(output) as sink:
                    async for part in service.results(batch, Wanted(), FORMATS[output.suffix.lower()]):
                        sink.write(part)
                return batch_json(batch)
            finally:
                await service.close()
    finally:
        pool.close()


async def _taken(service: BatchService, ask: Asked, file: Path, key: str) -> BatchRecord:
    """The batch of a file under a key, new or as it is by now."""
    form, digest = form_of(file), hashlib.sha256()
    if form == SWEEP:
        body = swept(file, ask.kind, ask.mode, ask.detail)
        digest.update(body)
        answer = await service.take_sweep(Sweep.read(body), key, digest)
    elif form == PARQUET:
        digest.update(key.encode())
        answer = await service.take_parquet(ask, file, key, digest)
    else:
        answer = await service.take_lines(ask, form == CSV, _parts(file), key, digest)
    return await service.get(json.loads(answer)["id"])


async def _parts(file: Path) -> AsyncIterator[bytes]:
    with file.open("rb") as source:
        while part := await asyncio.to_thread(source.read, READ_BYTES):
            yield part
