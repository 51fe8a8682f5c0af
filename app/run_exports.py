"""Export files of runs: made in a suitable process, awaited briefly, cached."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any, Protocol

from app.designs.problems import INVALID
from app.designs.registry import KINDS
from app.designs.schema import entry
from app.errors import Problem
from app.exports.export import Export, ExportOptions, ExportProcess, File, Refusal, Run
from app.exports.registry import EXPORTS, exports_for
from app.jobs import calls
from app.jobs.errors import BudgetExceeded, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.executor import PoolSettings, ProcessPool
from app.jobs.worker import Entry
from app.logging import get_logger

logger = get_logger(__name__)

WAIT_S = 3.0
"""Seconds a request waits for its file before a 202."""
SOLIDS_IDLE_S = 900.0
"""Idle time after which the process with the solid modeller (800 MB) is closed."""
CACHE_BYTES = 64 << 20
MAX_FAILURES = 100
_SOLIDS_MEMORY_BYTES = 4 << 30
_SOLIDS_BUDGET_S = 60.0

Key = tuple[str, str, ExportOptions]


def solid_pool(entry: Entry = calls.answer) -> ProcessPool:
    """A pool of one worker with the solid modeller loaded."""
    return ProcessPool(
        PoolSettings(
            workers=1,
            entry=entry,
            memory_bytes=_SOLIDS_MEMORY_BYTES,
            load=calls.no_load,
            preload="app.exports.solids_preload",
            kernels=False,
        )
    )


class Solids:
    """Executor for solids: started on first use, closed after idling."""

    def __init__(self, start: Callable[[], ProcessPool] = solid_pool, idle_s: float = SOLIDS_IDLE_S) -> None:
        self._start, self._idle_s = start, idle_s
        self._pool: ProcessPool | None = None
        self._used, self._calls = 0.0, 0
        self._timer: asyncio.TimerHandle | None = None

    @property
    def running(self) -> bool:
        return self._pool is not None

    async def run(self, kind_slug: str, mode: str, payload: bytes) -> File | Refusal:
        """Like ``Executor.run``; the first call waits for the modeller's import."""
        if self._pool is None:
            self._pool = self._start()
        self._calls += 1
        try:
            return await self._pool.run(kind_slug, mode, payload, _SOLIDS_BUDGET_S)
        finally:
            self._calls -= 1
            self._used = time.monotonic()
            self._watch()

    def _watch(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_later(self._idle_s, self._end_if_idle)

    def _end_if_idle(self) -> None:
        pool = self._pool
        if pool is None or self._calls or time.monotonic() - self._used < 0.9 * self._idle_s:
            return
        self._pool = None
        # close() blocks, so it must not run in the event loop.
        threading.Thread(target=pool.close, name="solids-end", daemon=True).start()

    def close(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        if self._pool is not None:
            self._pool.close()
            self._pool = None


def _unwrap(made: File | Refusal) -> File:
    """The file. Raises Problem if it was refused."""
    if isinstance(made, Refusal):
        raise Problem(422, INVALID, made.detail, [entry(made.pointer, made.detail, made.allowed)])
    return made


class ExportExecutor(Protocol):
    """Executor of exports that take a while."""

    async def run(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        """See ``app.jobs.executor.Executor.run``."""


class RunExports:
    """Makes and caches export files; valid indefinitely, because a run with a result never changes."""

    def __init__(self, executor: ExportExecutor, budget_s: float, solids: Solids | None = None) -> None:
        self._executor, self._budget_s = executor, budget_s
        self._solids = solids or Solids()
        self._tasks: dict[Key, asyncio.Task[File | Refusal]] = {}
        self._cache: OrderedDict[Key, File] = OrderedDict()
        self._failed: dict[Key, BaseException] = {}

    async def file(self, run: Run, name: str, options: ExportOptions, max_wait_s: float | None = None) -> File | None:
        """The file, or None while it is still being made. Raises Problem."""
        export = self._export(run, name)
        key = (run["id"], name, options)
        if (cached := self._cache.get(key)) is not None:
            self._cache.move_to_end(key)
            return cached
        if export.where is ExportProcess.SERVICE:
            return _unwrap(export.file(KINDS[run["kind"]], run, options))
        if (failure := self._failed.pop(key, None)) is not None:
            raise failure
        task = self._tasks.get(key)
        if task is None:
            task = self._tasks[key] = asyncio.create_task(self._make(export, run, options))
            task.add_done_callback(partial(self._finished, key))
        done, _ = await asyncio.wait({task}, timeout=WAIT_S if max_wait_s is None else max_wait_s)
        if not done:
            return None
        self._failed.pop(key, None)
        return _unwrap(task.result())

    def _finished(self, key: Key, task: asyncio.Task[File | Refusal]) -> None:
        """Cache the file, or the failure for the next request after a 202."""
        self._tasks.pop(key, None)
        if task.cancelled():
            return
        failure = task.exception()
        if failure is not None:
            self._failed[key] = failure
            while len(self._failed) > MAX_FAILURES:
                self._failed.pop(next(iter(self._failed)))
        elif isinstance(made := task.result(), File):
            self._store(key, made)

    def _export(self, run: Run, name: str) -> Export:
        export = EXPORTS.get(name)
        available = exports_for(run)
        if export is None:
            raise Problem(
                404, "No such export", "there are " + ", ".join(available) if available else "the run has none"
            )
        if run["result"] is None:
            raise Problem(409, "Nothing to export", f"the run is {run['status']}: it has no result")
        if name not in available:
            raise Problem(409, "Nothing to export", f"this run has no such file; it has {', '.join(available)}")
        if export.missing:
            raise Problem(
                501,
                "This installation cannot make it",
                f"{name} needs the extra [{export.extra}]: pip install 'crankwright[{export.extra}]'",
            )
        return export

    async def _make(self, export: Export, run: Run, options: ExportOptions) -> File | Refusal:
        payload = json.dumps({"run": run, "options": asdict(options)}).encode()
        mode = f"{calls.EXPORT}{export.name}"
        try:
            if export.where is ExportProcess.SOLIDS:
                return await self._solids.run(run["kind"], mode, payload)
            return await self._executor.run(run["kind"], mode, payload, self._budget_s)
        except BudgetExceeded as error:
            raise Problem(504, "The file took too long to make", str(error)) from error
        except MemoryExceeded as error:
            raise Problem(507, "The memory bound was reached", str(error)) from error
        except (SolveFailed, WorkerCrashed) as error:
            detail = getattr(error, "detail", "")
            logger.error("export_failed", run_id=run["id"], export=export.name, reason=str(error), exception=detail)
            raise Problem(500, "The file could not be made", "the run is there; the fault is in making it") from error

    def _store(self, key: Key, made: File) -> None:
        self._cache[key] = made
        while len(self._cache) > 1 and sum(len(file.content) for file in self._cache.values()) > CACHE_BYTES:
            self._cache.popitem(last=False)

    async def close(self) -> None:
        """Cancel exports in progress and close the modeller."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.to_thread(self._solids.close)
