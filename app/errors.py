"""Problem details (RFC 9457): the one shape in which the service says no."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from app.designs.refusals import INVALID, summed_up
from app.designs.schema import Entry
from app.jobs.errors import Busy, ExecutorClosed, Warming
from app.store.errors import IdempotencyConflict, InvalidCursor, StoreBusy, StoreFull, UnknownBatch, UnknownRun

if TYPE_CHECKING:  # the command line refuses without a web framework
    from fastapi import FastAPI, Request, Response

MEDIA_TYPE = "application/problem+json"


class Problem(Exception):
    """A refusal on its way to the client."""

    def __init__(
        self,
        status: int,
        title: str,
        detail: str,
        errors: list[Entry] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(detail)
        self.status = status
        self.headers = dict(headers or {})
        self.body: dict[str, Any] = {"type": "about:blank", "title": title, "status": status, "detail": detail}
        if errors is not None:
            self.body["errors"] = errors


def problem_response(problem: Problem) -> Response:
    """The problem as a response."""
    from fastapi import Response

    # ASCII only: a lone surrogate in a field's name cannot be encoded as UTF-8, but can be escaped.
    body = json.dumps(problem.body, allow_nan=False)
    return Response(body, status_code=problem.status, headers=problem.headers, media_type=MEDIA_TYPE)


def invalid(error: ValidationError) -> Problem:
    """The refusal of a body. Values are never echoed, for JSON cannot carry them all."""
    return refusal(error.errors(include_url=False, include_input=False))


def refusal(errors: Iterable[Mapping[str, Any]], depth: int = 0) -> Problem:
    """One entry per bad field; ``depth`` parts of each location are dropped."""
    detail, entries = summed_up(errors, depth)
    return Problem(422, INVALID, detail, entries)


def install(app: FastAPI, page: Callable[[Request, Problem], Response | None]) -> None:
    """Answer every refusal of the service with problem details, or with ``page`` where that makes one."""
    from fastapi.exceptions import RequestValidationError
    from starlette.exceptions import HTTPException

    def answer(request: Request, problem: Problem) -> Response:
        return page(request, problem) or problem_response(problem)

    @app.exception_handler(Problem)
    async def _problem(request: Request, problem: Problem) -> Response:
        return answer(request, problem)

    @app.exception_handler(RequestValidationError)
    async def _parameter(request: Request, error: RequestValidationError) -> Response:
        # The location starts with where the parameter was: query, header, path.
        return answer(request, refusal(error.errors(), depth=1))

    @app.exception_handler(HTTPException)
    async def _http(request: Request, error: HTTPException) -> Response:
        return answer(request, Problem(error.status_code, error.detail, error.detail, headers=error.headers))

    @app.exception_handler(IdempotencyConflict)
    async def _conflict(request: Request, error: IdempotencyConflict) -> Response:
        return answer(request, Problem(409, "The idempotency key is taken", str(error)))

    @app.exception_handler(UnknownRun)
    async def _unknown(request: Request, error: UnknownRun) -> Response:
        return answer(request, Problem(404, "No such run", "no run has this id"))

    @app.exception_handler(StoreFull)
    async def _full(request: Request, error: StoreFull) -> Response:
        return answer(request, Problem(507, "The disk is full", "nothing of this request was stored"))

    @app.exception_handler(StoreBusy)
    async def _locked(request: Request, error: StoreBusy) -> Response:
        detail = "another process holds the database; nothing of this request was stored"
        return answer(request, Problem(503, "The database is busy", detail, headers={"Retry-After": "1"}))

    @app.exception_handler(UnknownBatch)
    async def _unknown_batch(request: Request, error: UnknownBatch) -> Response:
        return answer(request, Problem(404, "No such batch", "no batch has this id"))

    @app.exception_handler(InvalidCursor)
    async def _cursor(request: Request, error: InvalidCursor) -> Response:
        entry = {"pointer": "/cursor", "detail": str(error), "allowed": "the next_cursor of an earlier page"}
        return answer(request, Problem(422, INVALID, str(error), [entry]))

    @app.exception_handler(Warming)
    async def _warming(request: Request, error: Warming) -> Response:
        wait = {"Retry-After": str(math.ceil(error.remaining_s))}
        return answer(request, Problem(503, "The kernels are being compiled", str(error), headers=wait))

    @app.exception_handler(Busy)
    @app.exception_handler(ExecutorClosed)
    async def _busy(request: Request, error: Exception) -> Response:
        return answer(request, Problem(503, "Too much work waits", str(error), headers={"Retry-After": "1"}))

    @app.exception_handler(Exception)
    async def _unforeseen(request: Request, error: Exception) -> Response:
        return answer(request, Problem(500, "Something went wrong", "the request was understood; the fault is here"))
