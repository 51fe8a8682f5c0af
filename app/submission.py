"""The path of a request from validation to a durable run with an answer, shared by the API and the pages."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
import time
from collections import Counter
from collections.abc import Awaitable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial

from pydantic import BaseModel

from app import metrics, runs
from app.accepted_runs import MAX_ATTEMPTS, AcceptedRuns
from app.access.caller import caller
from app.admission import Admission, OnStart
from app.designs.kind import REFUSED, Job, Kind, Mode
from app.designs.problems import INVALID, SOLVER_FAILED
from app.designs.progress import Progress
from app.designs.registry import KINDS, job_of
from app.designs.rehearsals import FIRST_RUN, rehearsals_of
from app.designs.schema import entry, time_budget_of
from app.encoded_answer import EncodedAnswer
from app.errors import Problem
from app.item_tables import lacks_tables, with_tables
from app.jobs.budget import budget
from app.jobs.calls import PICTURE
from app.jobs.errors import BudgetExceeded, Busy, ExecutorClosed, JobError, MemoryExceeded, ShareUsed
from app.jobs.executor import Executor
from app.jobs.fair_queue import FairQueue, JobLength, QueueLimits
from app.logging import get_logger
from app.run_references import resolve_references
from app.single_flight import SingleFlight
from app.solve_failures import FAILURES, log_failure, log_fields, problem_of
from app.store.errors import DamagedRecord, StoreClosed, UnknownRun
from app.store.faults import StoreFault
from app.store.leases import LEASE_S
from app.store.record import Finish, RunRecord, RunStatus, StoredResponse
from app.store.repository import RunStore
from app.store.run_leases import TakenOverRun
from app.store.viewer import viewer

logger = get_logger(__name__)

_RETRY_S, _MAX_RETRY_S = 0.2, 10.0
_SHORT_MODES = (Mode.CHECK, Mode.ANALYSIS)  # usually less than a second
_MAX_FULL_RESULTS = 64
_DRAW_AGAIN = {"Retry-After": "5"}


@cache
def _first_run() -> str:
    """The spec hash of the first run."""
    _job, request = next(rehearsals_of(*FIRST_RUN))
    return runs.queued(FIRST_RUN[0], Mode.DESIGN, request).spec_hash


def _part_of(run: RunRecord) -> str:
    """The part of the warm-up that compiles the run's kernels: that of its mode, or the first run's own part."""
    return FIRST_RUN[1] if run.spec_hash == _first_run() else run.mode


@dataclass(frozen=True)
class ServiceLimits:
    """Limits of the service.

    ``max_wait_s``: how long a request waits for a worker. ``short_s``: time after which a check or an analysis starts
    again. ``accepted`` and ``accepted_per_caller``: open runs accepted with 202, in total and per caller. ``lease_s``:
    silence of this process after which another takes those over.
    """

    max_wait_s: float = 30.0
    short_s: float = 0.2
    accepted: int = 200
    accepted_per_caller: int = 50
    lease_s: float = LEASE_S


@dataclass(frozen=True)
class Service:
    """State and dependencies of a running service."""

    store: RunStore
    executor: Executor
    solve_budget_s: float
    limits: ServiceLimits = field(default_factory=ServiceLimits)
    queue: FairQueue = field(default_factory=lambda: FairQueue(QueueLimits()))
    single_flight: SingleFlight = field(default_factory=SingleFlight)
    """Requests in progress, by idempotency key."""
    open_accepted: Counter[str] = field(default_factory=Counter)
    """Number of open accepted runs per caller."""
    progress: dict[str, Progress] = field(default_factory=dict)
    """Progress of long solves, by run id."""
    full_results: dict[str, bytes] = field(default_factory=dict)
    """Results of batch items that were solved again for their curves, by run id."""
    stopping: threading.Event = field(default_factory=threading.Event)
    """Set when a shutdown was requested."""

    @cached_property
    def admission(self) -> Admission:
        """The workers' slots, given in turn."""
        return Admission(self.queue, self.limits.max_wait_s, self.limits.short_s)

    @cached_property
    def accepted_runs(self) -> AcceptedRuns:
        """Runs accepted with 202."""
        return AcceptedRuns(self.store, self.limits.lease_s)

    async def answer(self, kind: Kind, mode: Mode, request: BaseModel) -> RunRecord:
        """Answer a request without storing the run. Raises Problem if the solver refuses it."""
        started = time.perf_counter()
        request = await self._prepared(request)
        job = job_of(kind, mode)
        run = runs.queued(kind.slug, mode, request)
        return await self._cached(run, job, started) or await self._solve(run, job, request, started)

    async def _cached(self, run: RunRecord, job: Job, started: float) -> RunRecord | None:
        """The run answered from an earlier one with the same spec, if one qualifies."""
        if not job.repeatable:
            return None
        earlier = await self.store.find_answer(run.spec_hash, run.solver_name, run.solver_version)
        if earlier is None or not runs.complete(earlier):
            return None
        # More time may find a better design; a diagnosis it does not change.
        if job.best_in_time and earlier.status == RunStatus.SUCCEEDED and not runs.met(earlier):
            return None
        return runs.repeated(run, earlier, started)

    async def _prepared(self, request: BaseModel) -> BaseModel:
        """The request with referenced runs filled in. Raises Problem for what this service cannot do."""
        asked = time_budget_of(request)
        if asked is not None and asked > self.solve_budget_s:
            most = f"at most {self.solve_budget_s:g}"
            found = entry("/time_budget_s", "is more than this service gives a solve", most)
            raise Problem(422, INVALID, found["detail"], [found])
        return await resolve_references(self.store, request)

    async def _solve(
        self, run: RunRecord, job: Job, request: BaseModel, started: float, on_start: OnStart | None = None
    ) -> RunRecord:
        """Solve; the run with its answer, or failed."""
        ended = await self._outcome(run, job, request, started, on_start)
        metrics.record_solve(run.kind, run.mode, ended.status, time.perf_counter() - started, runs.effects_of(ended))
        return ended

    async def _outcome(
        self, run: RunRecord, job: Job, request: BaseModel, started: float, on_start: OnStart | None
    ) -> RunRecord:
        try:
            answer = await self._run(run, job, request, on_start)
        except FAILURES as error:
            log_failure(run, error)
            return runs.failed(run, *problem_of(error), started)
        if answer.status == REFUSED and answer.parts["problem"] is not None:
            problem = json.loads(answer.parts["problem"])
            raise Problem(*(problem[name] for name in ("status", "title", "detail", "errors")))
        return runs.answered(run, answer, started)

    async def _run(self, run: RunRecord, job: Job, request: BaseModel, on_start: OnStart | None) -> EncodedAnswer:
        times = budget(self.solve_budget_s + job.extra_s(request), time_budget_of(request), job.best_in_time)
        payload = run.spec
        if times.solver_s is not None:
            payload = request.model_copy(update={"time_budget_s": times.solver_s}).model_dump_json().encode()
        call = partial(self.executor.run, run.kind, _part_of(run), payload)
        try:
            return await self.admission.run(
                call, times.kill_s, run.mode in _SHORT_MODES, partial(self._set_progress, run.id), on_start
            )
        finally:
            self.progress.pop(run.id, None)

    def _set_progress(self, run_id: str, progress: Progress) -> None:
        self.progress[run_id] = progress

    async def as_json(self, run_id: str, complete: bool = False) -> bytes:
        """A run as JSON, with its progress while it is open.

        With ``complete``, a batch item includes the curves it is stored without. Raises UnknownRun.
        """
        run = await (self.complete(run_id) if complete else self.store.get(run_id))
        return runs.run_json(run, self.progress.get(run_id))

    async def complete(self, run_id: str) -> RunRecord:
        """A run with all curves and tables.

        A batch item is stored without them; it is solved again, and the new result is used if the stored numbers agree.
        Raises UnknownRun.
        """
        run = await self.store.get(run_id)
        if not lacks_tables(run):
            return run
        if run_id not in self.full_results:
            try:
                call = partial(self.executor.run, run.kind, run.mode, run.spec)
                answer = (await self.admission.run(call, self.solve_budget_s, run.mode in _SHORT_MODES)).decoded()
            except JobError:
                return run
            result = with_tables(run, answer)
            if result is None:
                logger.warning("batch_item_not_reproduced", **log_fields(run))
                return run
            self.full_results[run_id] = result
            while len(self.full_results) > _MAX_FULL_RESULTS:
                self.full_results.pop(next(iter(self.full_results)))
        return replace(run, result=self.full_results[run_id])

    async def plot(self, run: RunRecord, name: str, run_json: bytes, language: str, units: str) -> str:
        """Draw a plot of a succeeded run given as JSON. Runs in a worker, since some plots compute what they draw.

        Raises Problem if it reaches the limit of time or memory.
        """
        payload = b'{"language":"%s","units":"%s","run":%s}' % (language.encode(), units.encode(), run_json)
        call = partial(self.executor.run, run.kind, f"{PICTURE}{name}", payload)
        try:
            return await self.admission.run(call, self.solve_budget_s, short=True)
        except BudgetExceeded as error:
            detail = f"drawing was stopped after {error.budget_s:g} s, as may happen while the service is busy"
            raise Problem(504, "The plot took too long to draw", detail, headers=_DRAW_AGAIN) from error
        except MemoryExceeded as error:
            raise Problem(507, "The memory bound was reached", str(error)) from error

    async def submit(
        self, kind: Kind, mode: Mode, request: BaseModel, key: str | None, request_hash: str
    ) -> StoredResponse:
        """Answer a request and store the run with its response, in one transaction.

        Concurrent requests with the same key share one solve and its response.
        """
        if not key:
            return await self._store_run(await self.answer(kind, mode, request), 201, key, request_hash)

        async def first() -> StoredResponse:
            known = await self.store.find_response(key, request_hash)
            return known or await self._store_run(await self.answer(kind, mode, request), 201, key, request_hash)

        return await self.single_flight.run((viewer.get().owner, key), request_hash, first)

    async def submit_later(
        self, kind: Kind, mode: Mode, request: BaseModel, key: str | None, request_hash: str
    ) -> StoredResponse:
        """Store the run as queued, respond 202, and solve in the background."""
        request = await self._prepared(request)
        run = runs.queued(kind.slug, mode, request)
        slot = self._reserve_slot()

        async def store_and_follow() -> StoredResponse:
            with slot:
                response = await self._store_run(run, 202, key, request_hash)
                if response.run_id == run.id:
                    solve = self._solve_when_warm(run, job_of(kind, mode), request, time.perf_counter())
                    self.accepted_runs.follow(run.id, self._finish(run, solve), slot.pop_all())
            return response

        # A stored run must be started even if the client disconnects now.
        return await asyncio.shield(asyncio.create_task(store_and_follow()))

    def _reserve_slot(self) -> contextlib.ExitStack:
        """Reserve one of the open accepted runs; closing the stack releases it.

        Raises ShareUsed if this caller has too many open runs, Busy if there are too many in total.
        """
        who = caller.get().name
        own, everyone = self.open_accepted[who], self.open_accepted.total()
        if own >= self.limits.accepted_per_caller:
            raise ShareUsed(f"{own} of your runs are open already", self.queue.retry_s(JobLength.LONG, 1))
        if everyone >= self.limits.accepted:
            raise Busy(f"{everyone} runs are open already", self.queue.retry_s(JobLength.LONG, 1))
        self.open_accepted[who] += 1
        slot = contextlib.ExitStack()
        slot.callback(self._release_slot, who)
        return slot

    def _release_slot(self, who: str) -> None:
        self.open_accepted[who] -= 1
        if not self.open_accepted[who]:
            del self.open_accepted[who]

    async def submit_within(self, kind: Kind, mode: Mode, request: BaseModel, max_wait_s: float) -> str:
        """Answer a request and store the run; return its id.

        If that takes longer than ``max_wait_s``, the run is stored as queued and the same solve continues in the
        background.
        """
        started = time.perf_counter()
        request = await self._prepared(request)
        job = job_of(kind, mode)
        run = runs.queued(kind.slug, mode, request)
        outcome = await self._cached(run, job, started)
        if outcome is None:
            solve = asyncio.create_task(self._solve(run, job, request, started))
            slot: contextlib.ExitStack | None = None
            try:
                done, _ = await asyncio.wait({solve}, timeout=max_wait_s)
                with contextlib.suppress(Busy):  # at the limit of accepted runs, wait for the answer instead
                    slot = None if done else self._reserve_slot()
                outcome = await solve if slot is None else None
            except asyncio.CancelledError:  # the client has disconnected
                solve.cancel()
                raise
            if slot is not None:
                continuation = self._continue_in_background(run, self._retry_if_busy(solve, run, job, request), slot)
                return await asyncio.shield(asyncio.create_task(continuation))
        return (await self._store_run(outcome, 201, None, "")).run_id

    async def _continue_in_background(
        self, run: RunRecord, solve: Awaitable[RunRecord], slot: contextlib.ExitStack
    ) -> str:
        """Store a run whose solve has started as queued; return its id."""
        with slot:
            await self._store_run(run, 202, None, "")
            self.accepted_runs.follow(run.id, self._finish(run, solve), slot.pop_all())
        return run.id

    async def _retry_if_busy(
        self, solve: Awaitable[RunRecord], run: RunRecord, job: Job, request: BaseModel
    ) -> RunRecord:
        """The result of the solve; solved again if it found no worker in time, because the run is now accepted."""
        try:
            return await solve
        except Busy:
            return await self._solve_when_warm(run, job, request, time.perf_counter())

    async def cancel(self, run_id: str) -> bytes:
        """Cancel an open run and its solve; return the run as JSON. Raises UnknownRun, and Problem if the run has
        ended."""
        await self.store.get(run_id)  # raises UnknownRun for a run of another owner
        if not await self.store.finish(run_id, Finish(RunStatus.CANCELLED)):
            status = (await self.store.get(run_id)).status
            raise Problem(409, "The run has ended", f"the run is {status} and cannot be cancelled")
        # Store first: however the solve ends now, the run stays cancelled.
        self.accepted_runs.cancel(run_id)
        return await self.as_json(run_id)

    def start(self) -> None:
        """Start taking over accepted runs whose processes have died."""
        self.accepted_runs.start(self._resume)

    async def _resume(self, taken: TakenOverRun) -> None:
        run, now = taken.run, time.perf_counter()
        try:
            job = job_of(KINDS[run.kind], Mode(run.mode))
            request = job.request.model_validate_json(run.spec)
            why = f"the service stopped {taken.attempts} times while this run was solved"
            resumable = taken.attempts < MAX_ATTEMPTS
        except (KeyError, ValueError):
            why, resumable = "the service stopped before this run ended, and this version cannot resume it", False
        if resumable:
            await self._finish(run, self._solve_when_warm(run, job, request, now))
        else:
            await self._store_end(run, runs.failed(run, 500, "The service stopped", why, now))

    async def _store_run(self, run: RunRecord, status: int, key: str | None, request_hash: str) -> StoredResponse:
        """Store a run, answered or accepted; return the response."""
        location = f"/api/v1/runs/{run.id}"
        response = StoredResponse(
            key or "", request_hash, run.id, status, location, "application/json", runs.run_json(run)
        )
        put = self.accepted_runs.put if status == 202 else self.store.put
        first = await put(run, response if key else None)
        return first or response

    async def _finish(self, run: RunRecord, solve: Awaitable[RunRecord]) -> None:
        """Wait for the solve of a queued run and store its end, whatever happens."""
        started = time.perf_counter()
        try:
            ended = await solve
        except Problem as problem:
            ended = runs.refused(run, problem.body, started)
        except ExecutorClosed:  # the run stays open for the next process
            return
        except Exception as error:
            logger.exception("background_solve_failed", **log_fields(run))
            ended = runs.failed(run, 500, SOLVER_FAILED, type(error).__name__, started)
        await self._store_end(run, ended)

    async def _store_end(self, run: RunRecord, ended: RunRecord) -> None:
        """Store the end of an accepted run, retrying while the database is unavailable. If it stays open, the next
        process solves it again."""
        pause_s = _RETRY_S
        while True:
            try:
                await self.store.finish(run.id, runs.end_of(ended))
                return
            except StoreFault as fault:
                logger.error("result_not_stored", **log_fields(run), reason=str(fault))
            except (DamagedRecord, UnknownRun, StoreClosed) as error:
                logger.error("result_not_stored", **log_fields(run), reason=str(error))
                return
            await asyncio.sleep(pause_s)
            pause_s = min(_MAX_RETRY_S, 2.0 * pause_s)

    async def _mark_running(self, run_id: str) -> None:
        with contextlib.suppress(StoreFault):  # only the end matters
            await self.store.start(run_id)

    async def _solve_when_warm(self, run: RunRecord, job: Job, request: BaseModel, started: float) -> RunRecord:
        """Solve once the kernels are compiled; an accepted run is never refused for a missing kernel."""
        while True:
            while not self.executor.is_warm(run.kind, _part_of(run)):
                await asyncio.sleep(_RETRY_S)
            try:
                return await self._solve(run, job, request, started, partial(self._mark_running, run.id))
            except Busy:
                await asyncio.sleep(_RETRY_S)

    async def close(self) -> None:
        """Release accepted runs, which stay open for the next process."""
        await self.accepted_runs.close()
