"""One request from validation to a durable, answered run: the same path for HTTP and for pages."""

from __future__ import annotations

import asyncio
import json
import math
import threading
import time
from collections.abc import Awaitable, Coroutine
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from pydantic import BaseModel

from app import runs
from app.designs.kind import REFUSED, Answer, Job, Kind, Mode
from app.designs.progress import Progress
from app.designs.references import UnfitRun, references, replaced
from app.designs.refusals import INVALID, json_pointer
from app.designs.registry import KINDS, job_of
from app.designs.schema import OUT_OF_TIME, DesignSettings, entry
from app.errors import Problem
from app.jobs.budget import budget
from app.jobs.calls import PICTURE
from app.jobs.errors import BudgetExceeded, Busy, ExecutorClosed, JobError, MemoryExceeded, SolveFailed, WorkerCrashed
from app.jobs.executor import Executor
from app.logging import get_logger
from app.store.errors import UnknownRun
from app.store.hashing import canonical_json
from app.store.record import Finish, RunRecord, RunStatus, StoredResponse
from app.store.repository import RunStore

logger = get_logger(__name__)

MOST_IN_BACKGROUND = 1000
"""Runs that may be queued or solved after their 202; one more is refused, not promised."""

_RETRY_S = 0.2
_MOST_COMPLETED = 64
_LAST_DIGITS = 1e-9


async def resolved(store: RunStore, request: BaseModel) -> BaseModel:
    """The request with every stored run that it names filled in. Raises Problem for a run that cannot serve."""
    for path, reference in list(references(request)):
        at = json_pointer((*path, "run_id"))
        try:
            run = json.loads(runs.run_json(await store.get(reference.run_id)))
            request = replaced(request, path, reference.filled(run))
        except UnknownRun:
            found = entry(at, "no run has this id", "the id of a stored run")
        except UnfitRun as unfit:
            found = entry(at, unfit.reason, unfit.allowed)
        else:
            continue
        raise Problem(422, INVALID, found["detail"], [found])
    return request


def time_asked(request: BaseModel) -> float | None:
    """What the request says that it may take [s], where it is one that can."""
    return request.time_budget_s if isinstance(request, DesignSettings) else None


def same(one: Any, other: Any) -> bool:
    """Whether two JSON values are the same but for the last digits of their numbers: many checks in one loop may round
    otherwise than one."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and isinstance(other, (int, float)):
        return math.isclose(one, other, rel_tol=_LAST_DIGITS, abs_tol=_LAST_DIGITS)
    return one == other


def _named(run: RunRecord) -> dict[str, str]:
    """What the log says of a run."""
    return {"run_id": run.id, "kind": run.kind, "mode": run.mode}


@dataclass(frozen=True)
class Service:
    """What a running service works with."""

    store: RunStore
    executor: Executor
    solve_budget_s: float
    background: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    """The solves after a 202, by the id of the run."""
    progress: dict[str, Progress] = field(default_factory=dict)
    """How far the long solves under way are, by the id of the run."""
    completed: dict[str, bytes] = field(default_factory=dict)
    """The results of items of batches that were solved once more for their curves, by the id of the run."""
    stopping: threading.Event = field(default_factory=threading.Event)
    """Set when the service was asked to stop."""

    async def answer(self, kind: Kind, mode: Mode, request: BaseModel) -> RunRecord:
        """The run for a request, answered but not stored yet. Raises Problem if the solver refuses the request."""
        started = time.perf_counter()
        request = await self._acceptable(request)
        job = job_of(kind, mode)
        run = runs.queued(kind.slug, mode, request)
        return await self._repeated(run, job, started) or await self._solve(run, job, request, started)

    async def _repeated(self, run: RunRecord, job: Job, started: float) -> RunRecord | None:
        """The run with the answer of an earlier one that was asked the same, if there is one that will do."""
        if not job.repeatable:
            return None
        earlier = await self.store.find_answer(run.spec_hash, run.solver_name, run.solver_version)
        if earlier is None or not runs.complete(earlier) or (job.best_in_time and not runs.met(earlier)):
            return None
        return runs.repeated(run, earlier, started)

    async def _acceptable(self, request: BaseModel) -> BaseModel:
        """The request with the runs that it names filled in. Raises Problem for what this service cannot do."""
        asked = time_asked(request)
        if asked is not None and asked > self.solve_budget_s:
            most = f"at most {self.solve_budget_s:g}"
            found = entry("/time_budget_s", "is more than this service gives a solve", most)
            raise Problem(422, INVALID, found["detail"], [found])
        return await resolved(self.store, request)

    async def _solve(self, run: RunRecord, job: Job, request: BaseModel, started: float) -> RunRecord:
        """The run with the solver's answer, or failed where it came to none."""
        try:
            answer = await self._run(run, job, request)
        except BudgetExceeded as error:
            return runs.failed(run, 504, OUT_OF_TIME, str(error), started)
        except MemoryExceeded as error:
            return runs.failed(run, 507, "The memory bound was reached", str(error), started)
        except WorkerCrashed as error:
            logger.error("worker_crashed", **_named(run), reason=str(error))
            return runs.failed(run, 500, "The solver failed", "the solve ended without an answer", started)
        except SolveFailed as error:
            logger.error("solve_failed", **_named(run), reason=str(error), exception=error.detail)
            return runs.failed(run, 500, "The solver failed", "the solve ended without an answer", started)
        if answer.status == REFUSED and answer.problem is not None:
            problem = answer.problem
            raise Problem(problem["status"], problem["title"], problem["detail"], problem["errors"])
        return runs.answered(run, answer, started)

    async def _run(self, run: RunRecord, job: Job, request: BaseModel) -> Answer:
        if job.inline:
            return job.run(request)
        times = budget(self.solve_budget_s + job.extra_s(request), time_asked(request), job.best_in_time)
        if times.solver_s is not None:
            request = request.model_copy(update={"time_budget_s": times.solver_s})
        payload = request.model_dump_json().encode()
        try:
            return await self.executor.run(run.kind, run.mode, payload, times.kill_s, partial(self._told, run.id))
        finally:
            self.progress.pop(run.id, None)

    def _told(self, run_id: str, progress: Progress) -> None:
        self.progress[run_id] = progress

    async def shown(self, run_id: str, whole: bool = False) -> bytes:
        """A run as JSON, with its progress while it is open; ``whole`` with what an item of a batch was stored without.
        Raises UnknownRun."""
        run = await (self.whole(run_id) if whole else self.store.get(run_id))
        return runs.run_json(run, self.progress.get(run_id))

    async def whole(self, run_id: str) -> RunRecord:
        """A run with the curves and tables that an item of a batch is stored without: solved once more, if that comes
        to the same numbers. Raises UnknownRun."""
        run = await self.store.get(run_id)
        if run.batch_id is None or run.status != RunStatus.SUCCEEDED or run.result is None:
            return run
        job, kept = job_of(KINDS[run.kind], Mode(run.mode)), json.loads(run.result)
        if not job.tables or not kept.keys().isdisjoint(job.tables):
            return run
        if run_id not in self.completed:
            try:
                budget_s = self.solve_budget_s
                answer = await self.executor.run(run.kind, run.mode, run.spec, budget_s)
            except JobError:
                return run
            if answer.result is None or not same(kept, {name: answer.result.get(name) for name in kept}):
                logger.warning("item_solved_differently", **_named(run))
                return run
            self.completed[run_id] = canonical_json({**answer.result, **kept})
            while len(self.completed) > _MOST_COMPLETED:
                self.completed.pop(next(iter(self.completed)))
        return replace(run, result=self.completed[run_id])

    async def drawn(self, run: RunRecord, plot: str, shown: bytes) -> str:
        """A plot of a succeeded run, given as JSON; in a worker, for some compute what they draw."""
        return await self.executor.run(run.kind, f"{PICTURE}{plot}", shown, self.solve_budget_s)

    async def submit(
        self, kind: Kind, mode: Mode, request: BaseModel, key: str | None, request_hash: str
    ) -> StoredResponse:
        """Answer a request and store the run with its answer, in one transaction."""
        run = await self.answer(kind, mode, request)
        return await self._keep(run, 201, key, request_hash)

    async def submit_later(
        self, kind: Kind, mode: Mode, request: BaseModel, key: str | None, request_hash: str
    ) -> StoredResponse:
        """Store the run as queued, answer 202, and solve in the background."""
        if len(self.background) >= MOST_IN_BACKGROUND:
            raise Busy(f"{len(self.background)} runs wait already")
        request = await self._acceptable(request)
        run = runs.queued(kind.slug, mode, request)
        response = await self._keep(run, 202, key, request_hash)
        if response.run_id == run.id:
            self._begin(run, job_of(kind, mode), request)
        return response

    async def submit_within(self, kind: Kind, mode: Mode, request: BaseModel, patience_s: float) -> str:
        """Answer a request and store the run; where that takes longer than one waits, store it as queued, and go on
        with the same solve in the background. The run's id."""
        started = time.perf_counter()
        request = await self._acceptable(request)
        job = job_of(kind, mode)
        run = runs.queued(kind.slug, mode, request)
        answered = await self._repeated(run, job, started)
        if answered is None:
            solve = asyncio.create_task(self._solve(run, job, request, started))
            done, _ = await asyncio.wait({solve}, timeout=patience_s)
            if not done and len(self.background) < MOST_IN_BACKGROUND:
                await self._keep(run, 202, None, "")
                self._follow(run, self._finish(run, solve))
                return run.id
            answered = await solve
        return (await self._keep(answered, 201, None, "")).run_id

    async def cancel(self, run_id: str) -> bytes:
        """End a queued or running run as cancelled, and its solve; the run as JSON. Raises UnknownRun, and Problem once
        the run has ended."""
        if not await self.store.finish(run_id, Finish(RunStatus.CANCELLED)):
            status = (await self.store.get(run_id)).status
            raise Problem(409, "The run has ended", f"the run is {status}; what has ended cannot be cancelled")
        # The store first: however the solve ends now, the run is cancelled and stays so.
        task = self.background.get(run_id)
        if task is not None:
            task.cancel()
        return await self.shown(run_id)

    async def resume(self) -> None:
        """Take up the runs that were promised by a 202 and left open when a former service process ended."""
        for run in await self.store.open_runs():
            try:
                job = job_of(KINDS[run.kind], Mode(run.mode))
                request = job.request.model_validate_json(run.spec)
            except (KeyError, ValueError):
                title, why = "The service stopped", "it ended before this run did, and this version cannot take it up"
                failed = runs.failed(run, 500, title, why, time.perf_counter())
                await self.store.finish(run.id, runs.end_of(failed))
            else:
                self._begin(run, job, request)

    def _begin(self, run: RunRecord, job: Job, request: BaseModel) -> None:
        self._follow(run, self._finish(run, self._solve_in_turn(run, job, request, time.perf_counter())))

    def _follow(self, run: RunRecord, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        self.background[run.id] = task
        task.add_done_callback(lambda _: self.background.pop(run.id, None))

    async def _keep(self, run: RunRecord, status: int, key: str | None, request_hash: str) -> StoredResponse:
        location = f"/api/v1/runs/{run.id}"
        response = StoredResponse(
            key or "", request_hash, run.id, status, location, "application/json", runs.run_json(run)
        )
        first = await self.store.put(run, response if key else None)
        return first or response

    async def _finish(self, run: RunRecord, solve: Awaitable[RunRecord]) -> None:
        """Wait for the solve of a queued run and write down how it ended, whatever happens."""
        started = time.perf_counter()
        await self.store.start(run.id)
        try:
            ended = await solve
        except Problem as problem:
            ended = runs.refused(run, problem.body, started)
        except ExecutorClosed:  # it stays open, and the next start takes it up
            return
        except Exception as error:
            logger.exception("background_solve_failed", **_named(run))
            ended = runs.failed(run, 500, "The solver failed", type(error).__name__, started)
        await self.store.finish(run.id, runs.end_of(ended))

    async def _solve_in_turn(self, run: RunRecord, job: Job, request: BaseModel, started: float) -> RunRecord:
        """Solve once the executor has room: a run that was promised is not refused for want of it."""
        while True:
            try:
                return await self._solve(run, job, request, started)
            except Busy:
                await asyncio.sleep(_RETRY_S)

    async def close(self) -> None:
        """Let go of background solves: their runs stay open and are taken up at the next start."""
        tasks = list(self.background.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
