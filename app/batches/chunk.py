"""Worker side of a batch: turns a chunk of rows as sent into items ready to be stored.

Parsing, solving and encoding all run in the worker; the service process only commits the result.
"""

from __future__ import annotations

import gc
import hashlib
import json
import pickle
import time
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic_core import to_json

from app.batches.alike import Alike
from app.batches.task import Needs, Solved, Task
from app.designs.kind import Answer, Detail, Job, Mode
from app.designs.many import answers_of, failure, refusal, validated
from app.designs.progress import Report
from app.designs.references import UnfitRun, may_refer, references, replaced
from app.designs.refusals import REPEATED, json_pointer, repetitions
from app.designs.registry import KINDS, job_of
from app.designs.schema import DesignSettings, entry, finite
from app.jobs.budget import budget
from app.names import cleaned
from app.store.batch_inputs import RepeatedNames, Row, Source, UnreadableRow, unpacked_rows
from app.store.batch_items import encoded, joined, packed, parts_json, sealed, unpacked
from app.store.batch_records import Item

_MAX_CACHED_ANSWERS = 4000
_MAX_REFUSED_BYTES = 20_000
_TIMING_DECIMALS = 7
"""Decimal places of a stored time in seconds."""


def answer(slug: str, mode: str, payload: bytes, _report: Report) -> Solved | Needs:
    """Solve the chunk of a pickled Task."""
    asked: Task = pickle.loads(payload)
    began, used = time.perf_counter(), time.process_time()
    with _gc_paused():
        found = _Chunk(slug, Mode(mode), asked).solved()
        if isinstance(found, Needs):
            return found
        return Solved(sealed(asked.batch, found), time.perf_counter() - began, time.process_time() - used)


class _Request(NamedTuple):
    """A request, its spec as JSON, the spec without the name (``plain``), and the hash of the latter (``key``)."""

    request: BaseModel
    spec: bytes
    plain: bytes
    key: bytes

    @property
    def number(self) -> int:
        """The first 64 bits of the hash as a signed integer, the form in which databases store it."""
        return int.from_bytes(self.key[:8], "big", signed=True)


@dataclass(frozen=True, slots=True)
class _Refused:
    """The answer to a row that is not a solvable request, and its spec as JSON if it has one."""

    answer: Answer
    spec: bytes | None


class _Answered(NamedTuple):
    """An answer as it is stored, without the spec: ``parts`` as JSON; ``reusable`` for an equal request."""

    status: str
    holds: bool | None
    figure: float | None
    parts: bytes
    reusable: bool

    @classmethod
    def of(cls, slug: str, mode: Mode, found: Answer) -> _Answered:
        parts = parts_of(slug, mode, found)
        text = parts_json(parts)
        # Cheap pre-check: non-finite numbers appear under these names, but so may ordinary text. One byte is sought
        # eight times as quickly as three.
        if ((b"N" in text and b"NaN" in text) or b"Infinity" in text) and not finite(parts):
            why = "the solver gave a number that is not finite"
            return cls.of(slug, mode, failure("The result is not finite", why))
        holds = None if found.verdict is None else bool(found.verdict["holds"])
        reusable = found.status == "infeasible" or (
            found.status == "succeeded" and (found.accuracy or {}).get("met", True)
        )
        return cls(found.status, holds, parts.get("figure"), text, reusable)


_NAME = {"name"}
_PARTS = ("result", "problem", "effects", "accuracy", "verdict")
_answer_cache: OrderedDict[bytes, _Answered] = OrderedDict()
"""Answers of this worker by request hash, the newest last."""


@contextmanager
def _gc_paused() -> Iterator[None]:
    """Disable the cyclic garbage collector: its passes over all answers are expensive and free nothing."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


class _Chunk:
    def __init__(self, slug: str, mode: Mode, task: Task) -> None:
        self.slug, self.mode, self.task = slug, mode, task
        self.job: Job = job_of(KINDS[slug], mode)
        self.detail = Detail(task.detail)
        self.subject = f"{slug} {mode} {self.detail} ".encode()
        self.needed: set[str] = set()
        # Asked of the model, not of each request: pydantic's own test of a type takes 0.3 us.
        self.refers, self.budgeted = may_refer(self.job.request), issubclass(self.job.request, DesignSettings)
        self.looks_up = task.looks_up and self.job.repeatable
        self.told: set[bytes] = set()
        """Keys for which an item has already been answered."""

    def solved(self) -> list[Item] | Needs:
        task, source = self.task, Source.from_json(self.task.source)
        alike = Alike(source, self._encoded)
        read = [self._read(source, alike, row) for row in unpacked_rows(task.block, task.start, task.end)]
        if self.needed:
            return Needs(frozenset(self.needed))
        requests = [asked for _, asked in read if isinstance(asked, _Request)]
        if self.looks_up and task.known is None and requests:
            return Needs(frozenset(), frozenset(each.number for each in requests))
        answers = self._answers(requests)
        items = []
        for index, (line, asked) in enumerate(read, task.first):
            if isinstance(asked, _Refused):
                items.append(self._item(index, line, asked.spec, self._answered(asked.answer)))
                continue
            found, repeated = answers[asked.key], asked.key in self.told
            self.told.add(asked.key)
            found_by = asked.number if self.looks_up and not repeated and found.reusable else None
            items.append(self._item(index, line, asked.spec, found, repeated, found_by))
        return items

    def _read(self, source: Source, alike: Alike, row: Row) -> tuple[int | None, _Request | _Refused]:
        """The line of a row, and its request or its refusal."""
        if (found := alike.read(row)) is not None:
            return row.line, self._asked(*found)
        try:
            body = source.body(row)
        except RepeatedNames as repeating:
            return row.line, _Refused(refusal(REPEATED, repetitions(repeating.paths)), None)
        except UnreadableRow as unreadable:
            wrong = [entry("", str(unreadable), unreadable.allowed)]
            return row.line, _Refused(refusal(f"the row {unreadable}", wrong), None)
        except RecursionError:
            return row.line, _Refused(refusal("the row is nested too deeply", []), None)
        request, refused = validated(self.job, body)
        if request is None:
            assert refused is not None
            return row.line, _Refused(refused, _storable_spec(body))
        filled = self._filled(request)
        if isinstance(filled, Answer):
            return row.line, _Refused(filled, request.model_dump_json().encode())
        plain = self._encoded(filled)
        # Requests like this one have no references either. Time budgets may vary, but designs take far longer anyway.
        if filled is request and not self.budgeted:
            alike.learn(row, (request, plain))
        return row.line, self._asked(filled, plain)

    @staticmethod
    def _encoded(request: BaseModel) -> bytes:
        # Bytes at once: ``model_dump_json`` would decode them to a text.
        return request.__pydantic_serializer__.to_json(request, exclude=_NAME)

    def _asked(self, request: BaseModel, plain: bytes) -> _Request:
        key = hashlib.sha256(self.subject + plain).digest()
        name = getattr(request, "name", None)
        spec = plain if name is None else b'{"name":' + to_json(name) + b"," + plain[1:]
        return _Request(request, spec, plain, key)

    def _filled(self, request: BaseModel) -> BaseModel | Answer:
        """The request with its run references resolved, or a refusal; checks its time budget against the service's."""
        asked = request.time_budget_s if self.budgeted else None
        if asked is not None and asked > self.task.solve_budget_s:
            most = f"at most {self.task.solve_budget_s:g}"
            found = entry("/time_budget_s", "is more than this service gives a solve", most)
            return refusal(found["detail"], [found])
        for path, reference in list(references(request)) if self.refers else ():
            if reference.run_id not in self.task.runs:
                self.needed.add(reference.run_id)
                continue
            run, at = self.task.runs[reference.run_id], json_pointer((*path, "run_id"))
            if run is None:
                return refusal("no run has this id", [entry(at, "no run has this id", "the id of a stored run")])
            try:
                request = replaced(request, path, reference.filled(json.loads(run)))
            except UnfitRun as unfit:
                return refusal(unfit.reason, [entry(at, unfit.reason, unfit.allowed)])
        return request

    def _answers(self, asked: Sequence[_Request]) -> dict[bytes, _Answered]:
        """The answers by key; equal requests are solved once."""
        answers = {each.key: _answer_cache[each.key] for each in asked if each.key in _answer_cache}
        for each in asked:
            stored = self.task.known.get(each.number) if self.task.known else None
            if stored is not None and (found := self._stored(each, stored)) is not None:
                answers[each.key] = found
        self.told |= answers.keys()
        new = {each.key: each.request for each in asked if each.key not in answers}
        found = answers_of(self.slug, self.mode, [self._timed(request) for request in new.values()], self.detail)
        solved = {key: self._answered(answer) for key, answer in zip(new, found, strict=True)}
        if self.detail is Detail.SCALARS and self.job.repeatable:
            self._cache(solved)
        return answers | solved

    def _answered(self, found: Answer) -> _Answered:
        return _Answered.of(self.slug, self.mode, found)

    def _stored(self, asked: _Request, item: Item) -> _Answered | None:
        """The answer of a stored item, if its request is the same (guards against hash collisions)."""
        parts = unpacked(item.content, self.task.dictionary)
        spec = parts.pop("spec")
        if {name: value for name, value in spec.items() if name != "name"} != json.loads(asked.plain):
            return None
        parts.pop("cached", None)
        return _Answered(item.status, item.holds, item.figure, parts_json(parts), True)

    def _cache(self, found: Mapping[bytes, _Answered]) -> None:
        _answer_cache.update((key, answer) for key, answer in found.items() if answer.reusable)
        while len(_answer_cache) > _MAX_CACHED_ANSWERS:
            _answer_cache.popitem(last=False)

    def _timed(self, request: BaseModel) -> BaseModel:
        if not self.budgeted:
            return request
        service_s = self.task.solve_budget_s + self.job.extra_s(request)
        times = budget(service_s, request.time_budget_s, self.job.best_in_time)
        return request if times.solver_s is None else request.model_copy(update={"time_budget_s": times.solver_s})

    def _item(
        self, index: int, line: int | None, spec: bytes | None, found: _Answered, repeated: bool = False,
        found_by: int | None = None,
    ) -> Item:  # fmt: skip
        content = packed(joined(spec, found.parts, repeated), self.task.dictionary)
        return Item(index, line, found.status, found.holds, found.figure, content, found_by)


def parts_of(slug: str, mode: Mode, found: Answer) -> dict[str, Any]:
    """The stored parts of an answer, besides its spec, by name; empty parts are omitted."""
    parts: dict[str, Any] = {name: part for name in _PARTS if (part := getattr(found, name)) is not None and part != []}
    if found.timing:
        parts["timing"] = {name: round(seconds, _TIMING_DECIMALS) for name, seconds in found.timing.items()}
    if found.status == "succeeded" and found.result is not None:
        name, value = KINDS[slug].headline(mode, found.result)
        if value is not None:
            parts["figure_name"], parts["figure"] = name, float(value)
    return parts


def _storable_spec(body: Any) -> bytes | None:
    """A refused body as the spec of its run, its name cleaned; None if it cannot be stored."""
    if isinstance(body, dict) and isinstance(name := body.get("name"), str):
        body = {**body, "name": cleaned(name)}
    try:
        text = to_json(body, inf_nan_mode="strings")
        return text if len(text) < _MAX_REFUSED_BYTES else None
    except (ValueError, RecursionError):  # text that JSON cannot represent
        return None


def failed_item(index: int, row: Row, source: Source, dictionary: bytes, status: int, title: str, detail: str) -> Item:
    """The stored form of an item that crashed its worker."""
    try:
        spec = _storable_spec(source.body(row))
    except UnreadableRow:
        spec = None
    problem = failure(title, detail, status).problem
    return Item(index, row.line, "failed", None, None, packed(encoded(spec, {"problem": problem}), dictionary))
