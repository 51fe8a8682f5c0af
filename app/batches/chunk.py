"""What a worker does with a chunk of a batch: from rows as they were sent to items as they are stored.

All of it happens in the worker, so that the service's own process has nothing left to do but to store.
"""

from __future__ import annotations

import hashlib
import json
import pickle
import time
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from app.batches.task import Needs, Solved, Task
from app.designs.kind import REFUSED, Answer, Detail, Job, Mode
from app.designs.many import accepted, answer_many
from app.designs.progress import Report
from app.designs.references import UnfitRun, references, replaced
from app.designs.refusals import INVALID, json_pointer
from app.designs.registry import KINDS, job_of
from app.designs.schema import DesignSettings, Entry, entry, finite
from app.jobs.budget import budget
from app.store.batch_inputs import Row, Source, UnreadableRow, unpacked_rows
from app.store.batch_items import packed
from app.store.batch_records import Item
from app.store.hashing import canonical_json

_REMEMBERED = 4000
_SECONDS = 7
"""Digits of a second that a stored time keeps."""


_remembered: OrderedDict[bytes, Answer] = OrderedDict()
"""Answers of this worker by what was asked, the newest last."""


def answer(slug: str, mode: str, payload: bytes, _report: Report) -> Solved | Needs:
    """Solve the chunk of a pickled Task."""
    asked: Task = pickle.loads(payload)
    began = time.perf_counter()
    found = _Chunk(slug, Mode(mode), asked).solved()
    return found if isinstance(found, Needs) else Solved(found, time.perf_counter() - began)


class _Chunk:
    def __init__(self, slug: str, mode: Mode, task: Task) -> None:
        self.slug, self.mode, self.task = slug, mode, task
        self.job: Job = job_of(KINDS[slug], mode)
        self.detail = Detail(task.detail)
        self.needed: set[str] = set()

    def solved(self) -> list[Item] | Needs:
        task, source = self.task, Source.from_json(self.task.source)
        rows = unpacked_rows(task.block, task.start, task.end)
        read = [self._read(source, row) for row in rows]
        if self.needed:
            return Needs(frozenset(self.needed))
        answers = self._answers([request for request, _ in read if isinstance(request, BaseModel)])
        items = []
        for index, (row, (request, spec)) in enumerate(zip(rows, read, strict=True), task.first):
            found, repeated = next(answers) if isinstance(request, BaseModel) else (request, False)
            items.append(self._item(index, row, spec, found, repeated))
        return items

    def _read(self, source: Source, row: Row) -> tuple[BaseModel | Answer, Any]:
        """The request of a row, or the answer that refuses it; and its spec."""
        try:
            body = source.body(row)
        except UnreadableRow as unreadable:
            return _refusal(f"the row {unreadable}", [entry("", str(unreadable), "one request of this kind")]), None
        except RecursionError:
            return _refusal("the row is nested too deeply", []), None
        request, refused = accepted(self.job, body)
        if request is None:
            assert refused is not None
            return refused, _sendable(body)
        filled = self._filled(request)
        spec = request.model_dump(mode="json") if isinstance(filled, Answer) else filled.model_dump(mode="json")
        return filled, spec

    def _filled(self, request: BaseModel) -> BaseModel | Answer:
        """The request with the runs that it names filled in and with a time budget that the service can give."""
        asked = request.time_budget_s if isinstance(request, DesignSettings) else None
        if asked is not None and asked > self.task.solve_budget_s:
            most = f"at most {self.task.solve_budget_s:g}"
            found = entry("/time_budget_s", "is more than this service gives a solve", most)
            return _refusal(found["detail"], [found])
        for path, reference in list(references(request)):
            if reference.run_id not in self.task.runs:
                self.needed.add(reference.run_id)
                continue
            run, at = self.task.runs[reference.run_id], json_pointer((*path, "run_id"))
            if run is None:
                return _refusal("no run has this id", [entry(at, "no run has this id", "the id of a stored run")])
            try:
                request = replaced(request, path, reference.filled(json.loads(run)))
            except UnfitRun as unfit:
                return _refusal(unfit.reason, [entry(at, unfit.reason, unfit.allowed)])
        return request

    def _answers(self, requests: Sequence[BaseModel]) -> Any:
        """For every request its answer, and whether it is that of an equal one; each of them is solved once."""
        keys = [self._key(request) for request in requests]
        known = {key: _remembered[key] for key in keys if key in _remembered}
        new = {key: request for key, request in zip(keys, requests, strict=True) if key not in known}
        timed = [self._timed(request) for request in new.values()]
        found = dict(zip(new, answer_many(self.slug, self.mode, timed, self.detail), strict=True))  # type: ignore[arg-type]
        if self.detail is Detail.SCALARS and self.job.repeatable:
            self._remember(found)
        told: set[bytes] = set(known)
        for key in keys:
            yield (known[key] if key in known else found[key]), key in told
            told.add(key)

    def _key(self, request: BaseModel) -> bytes:
        spec = request.model_dump_json(exclude={"name"}).encode()
        return hashlib.sha256(f"{self.slug} {self.mode} {self.detail} ".encode() + spec).digest()

    def _remember(self, found: Mapping[bytes, Answer]) -> None:
        for key, solved in found.items():
            if solved.status in ("succeeded", "infeasible") and (solved.accuracy or {}).get("met", True):
                _remembered[key] = solved
        while len(_remembered) > _REMEMBERED:
            _remembered.popitem(last=False)

    def _timed(self, request: BaseModel) -> BaseModel:
        if not isinstance(request, DesignSettings):
            return request
        service_s = self.task.solve_budget_s + self.job.extra_s(request)
        times = budget(service_s, request.time_budget_s, self.job.best_in_time)
        return request if times.solver_s is None else request.model_copy(update={"time_budget_s": times.solver_s})

    def _item(self, index: int, row: Row, spec: Any, found: Answer, repeated: bool) -> Item:
        if not all(finite(part) for part in (found.result, found.effects, found.accuracy, found.verdict)):
            found = _failure("The result is not finite", "the solver gave a number that is not finite")
        parts = parts_of(self.slug, self.mode, spec, found)
        if repeated:
            parts["cached"] = True
        figure = parts.pop("figure", None)
        holds = None if found.verdict is None else bool(found.verdict["holds"])
        return Item(index, row.line, found.status, holds, figure, packed(parts, self.task.dictionary))


def parts_of(slug: str, mode: Mode, spec: Any, found: Answer) -> dict[str, Any]:
    """What is kept of an answer, by name; what is empty is not kept."""
    parts = {
        "spec": spec,
        "result": found.result,
        "problem": found.problem,
        "effects": found.effects or None,
        "accuracy": found.accuracy,
        "verdict": found.verdict,
        "timing": {name: round(seconds, _SECONDS) for name, seconds in found.timing.items()} or None,
    }
    if found.status == "succeeded" and found.result is not None:
        name, value = KINDS[slug].figure(mode, found.result)
        if value is not None:
            parts |= {"figure_name": name, "figure": float(value)}
    return {name: part for name, part in parts.items() if part is not None}


def _sendable(body: Any) -> Any:
    """A refused body as the spec of its run, where it can be one."""
    try:
        return body if len(canonical_json(body)) < 20_000 else None
    except (ValueError, RecursionError):  # numbers or text that JSON cannot carry
        return None


def _refusal(detail: str, errors: list[Entry]) -> Answer:
    problem = {"type": "about:blank", "title": INVALID, "status": 422, "detail": detail, "errors": errors}
    return Answer(REFUSED, None, [], None, {}, problem)


def _failure(title: str, detail: str, status: int = 500) -> Answer:
    return Answer(
        "failed", None, [], None, {}, {"type": "about:blank", "title": title, "status": status, "detail": detail}
    )


def failed_item(index: int, row: Row, source: Source, dictionary: bytes, status: int, title: str, detail: str) -> Item:
    """An item that brings its worker down, as it is stored."""
    try:
        spec = _sendable(source.body(row))
    except UnreadableRow:
        spec = None
    problem = _failure(title, detail, status).problem
    parts = {"problem": problem} if spec is None else {"spec": spec, "problem": problem}
    return Item(index, row.line, "failed", None, None, packed(parts, dictionary))
