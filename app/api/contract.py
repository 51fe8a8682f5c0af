"""The OpenAPI document: every request, run and refusal of every kind with its schema, made from the registry.

The routes read and write bytes themselves, so the framework cannot see their models; this file tells it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any, Literal

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel, ConfigDict, Field, create_model
from pydantic.json_schema import models_json_schema

from app.api.descriptions import describe
from app.batches.results import MEDIA_TYPES, Format
from app.batches.sweep import Sweep
from app.designs.kind import Detail, Kind, Mode
from app.designs.problems import INVALID, problem_details
from app.designs.registry import KINDS, example_of, job_of, modes_of
from app.designs.schema import AccuracyResult, EffectResult, Infeasible
from app.designs.verdict import VerdictResult
from app.errors import MEDIA_TYPE
from app.store.record import RunStatus

PATHS = {Mode.DESIGN: "designs", Mode.CHECK: "checks", Mode.ANALYSIS: "analyses", Mode.ACCURACY: "accuracy"}
"""The part of the path that stands for a mode."""


_NOT_OURS = ("HTTPValidationError", "ValidationError")
"""The framework's own refusals, which the service does not send."""

_ROWS = ("application/x-ndjson", "text/csv", MEDIA_TYPES[Format.PARQUET])
"""Forms in which the rows of a batch are sent."""

EXAMPLES = {
    "409": problem_details("The idempotency key is taken", 409, "the key was used before with another request"),
    "413": problem_details("The request is too large", 413, "at most 1048576 bytes are accepted"),
    "415": problem_details("Not JSON", 415, "send application/json"),
    "422": problem_details(
        INVALID,
        422,
        "1 field cannot be accepted",
        [{"pointer": "/accuracy", "detail": "is out of range", "allowed": "at most 0.1"}],
    ),
}
"""Refusals of what was posted, as they look, by their status."""

ANSWERS = Path(__file__).with_name("answers.json")
"""What the service answers to every kind's own examples, lists cut short; made by ``scripts/answer_examples.py``."""

_ALWAYS = {
    "400": "no HTTP that can be read",
    "401": "a key is asked for, and none that is valid was sent",
    "403": "beyond the key's scope, or sent by a page of another site",
    "408": "the request did not arrive in time",
    "413": "the body is too large",
    "421": "the service does not answer under this host name",
    "429": "the caller's share is used; Retry-After says for how long",
    "431": "the head is too long",
    "500": "the fault is here, or the record is damaged",
    "503": "not now; Retry-After says when",
    "507": "the store is full",
}
"""Refusals that any request may meet before it is looked at, or for the state of the service."""

_REFERENCE = "#/components/schemas/{model}"


class _Shown(BaseModel):
    """What the service sends; every field is always there."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=True)


class ProblemEntry(_Shown):
    """One bad field."""

    pointer: str = Field(description="JSON pointer of the field (RFC 6901)")
    detail: str
    allowed: str


class ProblemDetails(_Shown):
    """A refusal (RFC 9457)."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=False)

    type: str
    title: str
    status: int
    detail: str
    errors: list[ProblemEntry] = []


class Solver(_Shown):
    """Who solved."""

    name: str
    version: str


class Figure(_Shown):
    """The number that matters most of a run: what a design was after, a part's mass, an engine's power."""

    name: str
    value: float


class RunLine(_Shown):
    """A line of the listing."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: datetime
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None = Field(description="the verdict's own; null: there is no verdict")
    figure: Figure | None = Field(description="null: there is no result, or the run is of before figures")
    solver: Solver


class RunPage(_Shown):
    """A page of the listing; ``next_cursor`` asks for the next one."""

    items: list[RunLine]
    next_cursor: str | None
    damaged: list[str] = Field(description="ids of runs that belong here too, but whose records are damaged")


class RunProgress(_Shown):
    """How far a run is."""

    done: int = Field(description="solutions that are there")
    of: int = Field(description="at most; a time budget may end the run before")
    doing: str


class Links(_Shown):
    """Where a run and what belongs to it are found."""

    self: str
    page: str
    plots: dict[str, str]
    exports: dict[str, str]


class Run(RunLine):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it is
    and what it took. ``status`` says only how the solve ended."""

    verdict: VerdictResult | None = Field(
        description="of every design and check that has an answer; null of all others, and of runs of before verdicts"
    )
    spec: dict[str, Any]
    result: dict[str, Any] | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None = Field(description="of a run under way, where it is a long one")


class BatchItems(_Shown):
    """How many items there are, and how those that are done ended."""

    total: int
    done: int
    succeeded: int
    infeasible: int
    failed: int
    refused: int = Field(description="rows that are no valid request")
    cancelled: int


class BatchLinks(_Shown):
    """Where a batch and what belongs to it are found."""

    self: str
    page: str
    results: str
    events: str
    runs: str


class Batch(_Shown):
    """Many requests of one kind and mode as one job; each of its items is a run."""

    id: str
    kind: str
    mode: Mode
    name: str
    detail: Detail
    status: Literal["queued", "running", "ended", "cancelled"]
    created_at: datetime
    ended_at: datetime | None
    items: BatchItems
    rate_per_s: float | None = Field(description="items a second since the first was begun")
    remaining_s: float | None = Field(description="null: nothing is known yet")
    solver: Solver
    links: BatchLinks


class BatchPage(_Shown):
    """A page of the list of batches; ``next_cursor`` asks for the next one."""

    items: list[Batch]
    next_cursor: str | None


@cache
def run_model(kind: Kind, mode: Mode) -> type[Run]:
    """The run of one kind and mode, with its own spec and result."""
    job = job_of(kind, mode)
    words = f"{kind.slug}-{mode}-run".split("-")
    return create_model(
        "".join(word.capitalize() for word in words),
        __base__=Run,
        __doc__=Run.__doc__,
        spec=(job.request, ...),
        result=(job.result | (job.infeasible or Infeasible) | None, ...),
    )


def _submissions() -> Iterator[tuple[str, Kind, Mode]]:
    for kind in KINDS.values():
        for mode in modes_of(kind):
            yield f"/api/v1/{PATHS[mode]}/{kind.slug}", kind, mode


def _renamed(found: Any, long: str, short: str) -> Any:
    """The same structure with a schema's name, and every reference to it, exchanged."""
    if isinstance(found, dict):
        return {short if key == long else key: _renamed(value, long, short) for key, value in found.items()}
    if isinstance(found, list | tuple):
        return type(found)(_renamed(value, long, short) for value in found)
    return _REFERENCE.format(model=short) if found == _REFERENCE.format(model=long) else found


def _named(definitions: dict[str, Any]) -> dict[str, str]:
    """A name of its own, without its module, for each schema that shares its class name with others."""
    names = {}
    for name in definitions:
        parts = name.split("__")
        if len(parts) > 1:
            package = parts[parts.index("designs") + 1]
            names[name] = "".join(word.capitalize() for word in package.split("_")) + parts[-1]
    return names


def document(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document of the application."""
    asked = {path: job_of(kind, mode).request for path, kind, mode in _submissions()}
    runs = {path: run_model(kind, mode) for path, kind, mode in _submissions()}
    shown = {ProblemDetails, RunPage, Run, Batch, BatchPage, *runs.values()}
    models = [(model, "validation") for model in (*asked.values(), Sweep)]
    models += [(model, "serialization") for model in shown]
    references, definitions = models_json_schema(models, ref_template=_REFERENCE)
    for long, short in _named(definitions["$defs"]).items():
        references, definitions = _renamed((references, definitions), long, short)
    found = get_openapi(title=app.title, version=app.version, summary=app.summary, routes=app.routes)
    # The framework knows the words that parameters can be, and what routes with a model of their own answer.
    known = {name: schema for name, schema in found["components"]["schemas"].items() if name not in _NOT_OURS}
    found["components"] = {"schemas": known | definitions["$defs"]}
    describe(found["components"]["schemas"])

    def content(model: type[BaseModel], way: str = "serialization") -> dict[str, Any]:
        return {"application/json": {"schema": references[(model, way)]}}

    answers = json.loads(ANSWERS.read_text("utf-8"))
    for path, kind, mode in _submissions():
        post = found["paths"][path]["post"]
        body = content(asked[path], "validation")
        body["application/json"]["example"] = example_of(kind, mode)
        post["requestBody"] = {"required": True, "content": body}
        for status in post["responses"].keys() & {"201", "202"}:
            post["responses"][status]["content"] = content(runs[path])
        if (answer := answers.get(f"{kind.slug} {mode}")) is not None:
            post["responses"]["201"]["content"]["application/json"]["example"] = answer
    listing, one = found["paths"]["/api/v1/runs"]["get"], found["paths"]["/api/v1/runs/{run_id}"]["get"]
    cancelled = found["paths"]["/api/v1/runs/{run_id}"]["delete"]
    cancelled["responses"]["200"]["content"] = content(Run)
    listing["responses"]["200"]["content"], one["responses"]["200"]["content"] = content(RunPage), content(Run)
    batches, batch = found["paths"]["/api/v1/batches"], found["paths"]["/api/v1/batches/{batch_id}"]
    rows = {form: {"schema": {"type": "string", "format": "binary"}} for form in _ROWS}
    batches["post"]["requestBody"] = {"required": True, "content": {**content(Sweep, "validation"), **rows}}
    batches["post"]["responses"]["202"]["content"] = content(Batch)
    batches["get"]["responses"]["200"]["content"] = content(BatchPage)
    for method in ("get", "delete"):
        batch[method]["responses"]["200"]["content"] = content(Batch)
    results, events = (found["paths"][f"/api/v1/batches/{{batch_id}}/{part}"]["get"] for part in ("results", "events"))
    results["responses"]["200"]["content"] = {
        form.partition(";")[0]: {"schema": {"type": "string"}} for form in MEDIA_TYPES.values()
    }
    # Of a stream, OpenAPI 3.1 describes each event.
    told = {
        "type": "string",
        "contentMediaType": "application/json",
        "contentSchema": references[(Batch, "serialization")],
    }
    event = {"event": {"type": "string", "enum": ["progress", "ended"]}, "data": told}
    schema = {"type": "object", "properties": event, "required": ["event", "data"]}
    events["responses"]["200"]["content"] = {"text/event-stream": {"schema": schema}}
    refusal = {"schema": references[(ProblemDetails, "serialization")]}
    for path, operations in found["paths"].items():
        for method, operation in operations.items():
            if path.startswith("/api/"):
                operation["responses"] = {status: {"description": why} for status, why in _ALWAYS.items()} | operation[
                    "responses"
                ]
            for status, response in operation["responses"].items():
                if int(status) >= 400:
                    example = {"example": EXAMPLES[status]} if method == "post" and status in EXAMPLES else {}
                    response["content"] = {MEDIA_TYPE: {**refusal, **example}}
    return found


def install(app: FastAPI) -> None:
    """Serve this document instead of the framework's own."""

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = document(app)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]
