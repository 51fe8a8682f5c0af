"""One request from validation to a durable, answered run: the same path for HTTP and for pages."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

from pydantic import BaseModel

from app import metrics, runs
from app.access.caller import caller
from app.designs.kind import REFUSED, Answer, Job, Kind, Mode
from app.designs.problems import INVALID, OUT_OF_TIME
from app.designs.progress import Progress, Report, to_nobody
from app.designs.registry import KINDS, job_of
from app.designs.schema import entry, time_asked
from app.errors import Problem
from app.jobs.budget import budget
from app.jobs.calls import PICTURE
from app.jobs.errors import (
    BudgetExceeded,
    Busy,
    ExecutorClosed,
    JobError,
    MemoryExceeded,
    ShareUsed,
    SolveFailed,
    WorkerCrashed,
)
from app.jobs.executor import Executor
from app.jobs.turns import Length, TurnLimits, Turns
from app.logging import get_logger
from app.promises import MOST_ATTEMPTS, Promises
from app.referring import resolved
from app.sameness import same
from app.single_flight import Flights
from app.solve_ends import cut, named
from app.store.errors import DamagedRecord, StoreClosed, UnknownRun
from app.store.faults import StoreFault
from app.store.hashing import canonical_json
from app.store.leases import LEASE_S
from app.store.promises import TakenOver
from app.store.record import Finish, RunRecord, RunStatus, StoredResponse
from app.store.repository import RunStore
from app.store.viewer import viewer

logger = get_logger(__name__)

Begun = Callable[[], Awaitable[object]]
"""Says that a promised run has a worker now."""
Call = Callable[[float, Report], Awaitable[Any]]
"""``(seconds until it is killed, report) -> answer``."""

_RETRY_S, _LONGEST_PAUSE_S = 0.2, 10.0
_SHORT = (Mode.CHECK, Mode.ANALYSIS)
"""Modes that usually end in a moment."""
_MOST_COMPLETED = 64
_CRASHES_BORNE = 5
"""So often a promised run is begun again whose worker was killed, by the system or by anybody."""


@dataclass(frozen=True)
class ServiceLimits:
    """``patience_s`` is how long a request waits for a worker; ``short_s`` after what a check or an analysis counts as
    long work; ``accepted`` how many runs may be open after a 202, ``accepted_of_one`` those of one caller; ``lease_s``
    after what silence of this process another takes those over."""

    patience_s: float = 30.0
    short_s: float = 1.0
    accepted: int = 200
    accepted_of_one: int = 50
    lease_s: float = LEASE_S


@dataclass(frozen=True)
class Service:
    """What a running service works with."""

    store: RunStore
    executor: Executor
    solve_budget_s: float
    limits: ServiceLimits = field(default_factory=ServiceLimits)
    turns: Turns = field(default_factory=lambda: Turns(TurnLimits()))
    flights: Flights = field(default_factory=Flights)
    """What is solved under an idempotency key just now."""
    accepted: Counter[str] = field(default_factory=Counter)
    """How many open runs were promised to each caller."""
    progress: dict[str, Progress] = field(default_factory=dict)
    """How far the long solves under way are, by the id of the run."""
    completed: dict[str, bytes] = field(default_factory=dict)
    """The results of items of batches that were solved once more for their curves, by the id of the run."""
    stopping: threading.Event = field(default_factory=threading.Event)
    """Set when the service was asked to stop."""

    @cached_property
    def promises(self) -> Promises:
        """The runs after a 202."""
        return Promises(self.store, self.limits.lease_s)

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

    async def _solve(
        self, run: RunRecord, job: Job, request: BaseModel, started: float, begun: Begun | None = None
    ) -> RunRecord:
        """The run with the solver's answer, or failed where it came to none."""
        ended = await self._ended(run, job, request, started, begun)
        seconds = time.perf_counter() - started
        metrics.solved(run.kind, run.mode, ended.status, seconds, json.loads(ended.effects))
        return ended

    async def _ended(
        self, run: RunRecord, job: Job, request: BaseModel, started: float, begun: Begun | None
    ) -> RunRecord:
        try:
            answer = await self._run(run, job, request, begun)
        except BudgetExceeded as error:
            cut("overrun", run, error)
            return runs.failed(run, 504, OUT_OF_TIME, str(error), started)
        except MemoryExceeded as error:
            cut("memory", run, error)
            return runs.failed(run, 507, "The memory bound was reached", str(error), started)
        except WorkerCrashed as error:
            cut("crash", run, error)
            return runs.failed(run, 500, "The solver failed", "the solve ended without an answer", started)
        except SolveFailed as error:
            cut("failure", run, error, exception=error.detail)
            return runs.failed(run, 500, "The solver failed", "the solve ended without an answer", started)
        if answer.status == REFUSED and answer.problem is not None:
            problem = answer.problem
            raise Problem(problem["status"], problem["title"], problem["detail"], problem["errors"])
        return runs.answered(run, answer, started)

    async def _run(self, run: RunRecord, job: Job, request: BaseModel, begun: Begun | None) -> Answer:
        if job.inline:
            return job.run(request)
        times = budget(self.solve_budget_s + job.extra_s(request), time_asked(request), job.best_in_time)
        if times.solver_s is not None:
            request = request.model_copy(update={"time_budget_s": times.solver_s})
        payload = request.model_dump_json().encode()
        call = partial(self.executor.run, run.kind, run.mode, payload)
        try:
            return await self._in_turn(call, times.kill_s, run.mode in _SHORT, partial(self._told, run.id), begun)
        finally:
            self.progress.pop(run.id, None)

    async def _in_turn(
        self, call: Call, kill_s: float, short: bool, report: Report = to_nobody, begun: Begun | None = None
    ) -> Any:
        """The call's answer, once a worker is free for it. What was promised says when it has ``begun``, and waits as
        long as it takes. Short work that turns out to be long gives its worker back and begins again as long work."""
        who, patience_s = caller.get().name, None if begun else self.limits.patience_s
        if short:
            async with self.turns.turn(Length.SHORT, who, patience_s):
                try:
                    return await call(min(kill_s, self.limits.short_s), report)
                except BudgetExceeded:
                    if kill_s <= self.limits.short_s:
                        raise
        async with self.turns.turn(Length.LONG, who, patience_s):
            if begun is not None:
                await begun()
                for _ in range(_CRASHES_BORNE):
                    with contextlib.suppress(WorkerCrashed):
                        return await call(kill_s, report)
            return await call(kill_s, report)

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
                call = partial(self.executor.run, run.kind, run.mode, run.spec)
                answer = await self._in_turn(call, self.solve_budget_s, run.mode in _SHORT)
            except JobError:
                return run
            if answer.result is None or not same(kept, {name: answer.result.get(name) for name in kept}):
                logger.warning("item_solved_differently", **named(run))
                return run
            self.completed[run_id] = canonical_json({**answer.result, **kept})
            while len(self.completed) > _MOST_COMPLETED:
                self.completed.pop(next(iter(self.completed)))
        return replace(run, result=self.completed[run_id])

    async def drawn(self, run: RunRecord, plot: str, shown: bytes, language: str) -> str:
        """A plot of a succeeded run, given as JSON; in a worker, for some compute what they draw."""
        asked = b'{"language":"%s","run":%s}' % (language.encode(), shown)
        call = partial(self.executor.run, run.kind, f"{PICTURE}{plot}", asked)
        return await self._in_turn(call, self.solve_budget_s, short=True)

    async def submit(
        self, kind: Kind, mode: Mode, request: BaseModel, key: str | None, request_hash: str
    ) -> StoredResponse:
        """Answer a request and store the run with its answer, in one transaction.

        Who comes with the same key meanwhile gets the same answer: it is solved once.
        """
        if not key:
            return await self._keep(await self.answer(kind, mode, request), 201, key, request_hash)

        async def first() -> StoredResponse:
            known = await self.store.find_response(key, request_hash)
            return known or await self._keep(await self.answer(kind, mode, request), 201, key, request_hash)

        return await self.flights.once((viewer.get().owner, key), request_hash, first)

    async def submit_later(
        self, kind: Kind, mode: Mode, request: BaseModel, key: str | None, request_hash: str
    ) -> StoredResponse:
        """Store the run as queued, answer 202, and solve in the background."""
        request = await self._acceptable(request)
        run = runs.queued(kind.slug, mode, request)
        place = self._place()

        async def promised() -> StoredResponse:
            with place:
                response = await self._keep(run, 202, key, request_hash)
                if response.run_id == run.id:
                    solve = self._solve_once_warm(run, job_of(kind, mode), request, time.perf_counter())
                    self.promises.follow(run.id, self._finish(run, solve), place.pop_all())
            return response

        # What is stored as queued is begun, even where its client goes away in between.
        return await asyncio.shield(asyncio.create_task(promised()))

    def _place(self) -> contextlib.ExitStack:
        """A place among the promised runs, given back when the stack is closed.

        Raises Busy where too many runs are open already, and ShareUsed where too many of this caller's are.
        """
        who = caller.get().name
        own, everyone = self.accepted[who], self.accepted.total()
        if own >= self.limits.accepted_of_one:
            raise ShareUsed(f"{own} runs of yours are open already", self.turns.retry_s(Length.LONG, 1))
        if everyone >= self.limits.accepted:
            raise Busy(f"{everyone} runs are open already", self.turns.retry_s(Length.LONG, 1))
        self.accepted[who] += 1
        place = contextlib.ExitStack()
        place.callback(self._give_back, who)
        return place

    def _give_back(self, who: str) -> None:
        self.accepted[who] -= 1
        if not self.accepted[who]:
            del self.accepted[who]

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
            place: contextlib.ExitStack | None = None
            try:
                done, _ = await asyncio.wait({solve}, timeout=patience_s)
                with contextlib.suppress(Busy):  # without a place for one more promise it is waited for
                    place = None if done else self._place()
                answered = await solve if place is None else None
            except asyncio.CancelledError:  # the client is gone
                solve.cancel()
                raise
            if place is not None:
                going_on = self._go_on(run, self._insisted(solve, run, job, request), place)
                return await asyncio.shield(asyncio.create_task(going_on))
        return (await self._keep(answered, 201, None, "")).run_id

    async def _go_on(self, run: RunRecord, solve: Awaitable[RunRecord], place: contextlib.ExitStack) -> str:
        """Store a run as queued whose solve has begun; its id."""
        with place:
            await self._keep(run, 202, None, "")
            self.promises.follow(run.id, self._finish(run, solve), place.pop_all())
        return run.id

    async def _insisted(self, solve: Awaitable[RunRecord], run: RunRecord, job: Job, request: BaseModel) -> RunRecord:
        """What the solve gives; begun again where it waited in vain for a worker, for now it is promised."""
        try:
            return await solve
        except Busy:
            return await self._solve_once_warm(run, job, request, time.perf_counter())

    async def cancel(self, run_id: str) -> bytes:
        """End a queued or running run as cancelled, and its solve; the run as JSON. Raises UnknownRun, and Problem once
        the run has ended."""
        await self.store.get(run_id)  # UnknownRun where it is another's
        if not await self.store.finish(run_id, Finish(RunStatus.CANCELLED)):
            status = (await self.store.get(run_id)).status
            raise Problem(409, "The run has ended", f"the run is {status}; what has ended cannot be cancelled")
        # The store first: however the solve ends now, the run is cancelled and stays so.
        self.promises.cancel(run_id)
        return await self.shown(run_id)

    def start(self) -> None:
        """Begin to take over the runs that were promised by processes which have ended."""
        self.promises.start(self._taken_up)

    async def _taken_up(self, taken: TakenOver) -> None:
        run, now = taken.run, time.perf_counter()
        title = "The service stopped"
        try:
            job = job_of(KINDS[run.kind], Mode(run.mode))
            request = job.request.model_validate_json(run.spec)
        except (KeyError, ValueError):
            why = "it ended before this run did, and this version cannot take it up"
            await self._write_down(run, runs.failed(run, 500, title, why, now))
            return
        if taken.attempts >= MOST_ATTEMPTS:
            why = f"it ended {taken.attempts} times while this run was solved"
            await self._write_down(run, runs.failed(run, 500, title, why, now))
            return
        await self._finish(run, self._solve_once_warm(run, job, request, now))

    async def _keep(self, run: RunRecord, status: int, key: str | None, request_hash: str) -> StoredResponse:
        """Store a run, answered or promised; what is to be answered."""
        location = f"/api/v1/runs/{run.id}"
        response = StoredResponse(
            key or "", request_hash, run.id, status, location, "application/json", runs.run_json(run)
        )
        put = self.promises.put if status == 202 else self.store.put
        first = await put(run, response if key else None)
        return first or response

    async def _finish(self, run: RunRecord, solve: Awaitable[RunRecord]) -> None:
        """Wait for the solve of a queued run and write down how it ended, whatever happens."""
        started = time.perf_counter()
        try:
            ended = await solve
        except Problem as problem:
            ended = runs.refused(run, problem.body, started)
        except ExecutorClosed:  # it stays open, and the next process takes it up
            return
        except Exception as error:
            logger.exception("background_solve_failed", **named(run))
            ended = runs.failed(run, 500, "The solver failed", type(error).__name__, started)
        await self._write_down(run, ended)

    async def _write_down(self, run: RunRecord, ended: RunRecord) -> None:
        """Store how a run ended, as soon as the store can: it was promised. What stays open the next process solves."""
        pause_s = _RETRY_S
        while True:
            try:
                await self.store.finish(run.id, runs.end_of(ended))
                return
            except StoreFault as fault:
                logger.error("end_not_stored", **named(run), reason=str(fault))
            except (DamagedRecord, UnknownRun, StoreClosed) as error:
                logger.error("end_not_stored", **named(run), reason=str(error))
                return
            await asyncio.sleep(pause_s)
            pause_s = min(_LONGEST_PAUSE_S, 2.0 * pause_s)

    async def _note_start(self, run_id: str) -> None:
        with contextlib.suppress(StoreFault):  # its end is what matters
            await self.store.start(run_id)

    async def _solve_once_warm(self, run: RunRecord, job: Job, request: BaseModel, started: float) -> RunRecord:
        """Solve once the kernels are there: a run that was promised is not refused for want of them."""
        while True:
            while any(each.kind == run.kind and each.remaining_s > 0 for each in self.executor.warmths):
                await asyncio.sleep(_RETRY_S)
            try:
                return await self._solve(run, job, request, started, partial(self._note_start, run.id))
            except Busy:
                await asyncio.sleep(_RETRY_S)

    async def close(self) -> None:
        """Let go of promised runs: they stay open, and the next process takes them up."""
        await self.promises.close()


@dataclass(frozen=True)
class InTurn:
    """What else is computed for a request, as short work in turn with all other."""

    service: Service

    async def run(self, kind_slug: str, mode: str, payload: bytes, budget_s: float) -> Any:
        """Like an executor's."""
        call = partial(self.service.executor.run, kind_slug, mode, payload)
        return await self.service._in_turn(call, budget_s, short=True)
