"""Problem details (RFC 9457), the format of every error response."""

from __future__ import annotations

import errno
import json
import math
from collections.abc import Awaitable, Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from app.designs.problems import DAMAGED, DISK_FULL, INVALID, NO_ROOM, NOT_SHOWN, problem_details
from app.designs.refusals import summarize
from app.designs.schema import Entry
from app.edge.disconnect import ClientDisconnected
from app.jobs.errors import Busy, ExecutorClosed, ShareUsed, Warming
from app.logging import get_logger
from app.store.errors import DamagedRecord, IdempotencyConflict, InvalidCursor, StoreClosed, UnknownBatch, UnknownRun
from app.store.faults import FaultKind, StoreFault

if TYPE_CHECKING:  # the command line works without the web framework
    from fastapi import FastAPI, Request, Response


logger = get_logger(__name__)

CLIENT_GONE = 499
"""Status logged when the client has disconnected."""
MEDIA_TYPE = "application/problem+json"


class Problem(Exception):
    """An error response, raised as an exception."""

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
        self.body: dict[str, Any] = problem_details(title, status, detail, errors)


def problem_response(problem: Problem) -> Response:
    """Render a problem."""
    from fastapi import Response

    # ASCII only: a lone surrogate in a field name can be escaped but not encoded as UTF-8.
    body = json.dumps(problem.body, allow_nan=False)
    return Response(body, status_code=problem.status, headers=problem.headers, media_type=MEDIA_TYPE)


def invalid(error: ValidationError, model: Any) -> Problem:
    """The problem for a body rejected by its model. Values are never echoed, since JSON cannot represent all of
    them."""
    return refusal(error.errors(include_url=False), model=model)


def refusal(errors: Iterable[Mapping[str, Any]], depth: int = 0, model: Any = None) -> Problem:
    """The problem for validation errors, with one entry per invalid field; see ``summarize``."""
    detail, entries = summarize(errors, depth, model)
    return Problem(422, INVALID, detail, entries)


def busy(error: Busy) -> Problem:
    """The problem for a busy service, with Retry-After."""
    status, title = next(entry for kind, entry in _BUSY.items() if isinstance(error, kind))
    return Problem(status, title, str(error), headers={"Retry-After": str(max(1, math.ceil(error.retry_s)))})


def store_problem(fault: StoreFault) -> Problem:
    """The client's problem for a store fault; details go to the log only."""
    logger.error("store_fault", fault=fault.kind.name.lower(), reason=str(fault))
    status = {FaultKind.FULL: 507, FaultKind.DAMAGED: 500}.get(fault.kind, 503)
    wait = {"Retry-After": "5"} if status == 503 else {}
    return Problem(status, "The store cannot be used", f"{fault.kind}; nothing was stored", headers=wait)


_BUSY: dict[type[Busy], tuple[int, str]] = {
    Warming: (503, "The kernels are being compiled"),
    ShareUsed: (429, "Your share is used"),
    Busy: (503, "Too much work waits"),
}


def _damaged(error: DamagedRecord) -> Problem:
    logger.error("record_damaged", table=error.table, key=error.key)
    return Problem(500, DAMAGED, NOT_SHOWN)


def _disk_full(error: BaseException | None) -> Problem | None:
    """The problem of an operating system error, if it says that a disk is full."""
    if not isinstance(error, OSError) or error.errno not in (errno.ENOSPC, errno.EDQUOT):
        return None
    logger.error("temporary_files_full", reason=str(error))
    return Problem(507, DISK_FULL, NO_ROOM)


@contextmanager
def refusing_if_disk_is_full() -> Iterator[None]:
    """Raise Problem 507 instead of the operating system's error that a disk is full."""
    try:
        yield
    except OSError as error:
        if full := _disk_full(error):
            raise full from error
        raise


def _http(error: Any) -> Problem:
    # The framework calls every error in the reading of a form, which it keeps in a file, a 400.
    return _disk_full(error.__cause__) or Problem(error.status_code, error.detail, error.detail, headers=error.headers)


def _cursor(error: InvalidCursor) -> Problem:
    entry = {"pointer": "/cursor", "detail": str(error), "allowed": "the next_cursor of an earlier page"}
    return Problem(422, INVALID, str(error), [entry])


def _stopping(error: Exception) -> Problem:
    return Problem(503, "The service stops", str(error), headers={"Retry-After": "5"})


PASSING = (Busy, StoreFault, StoreClosed, ExecutorClosed)
"""Errors of a service that cannot do now what it may do later: a form is shown again with what was typed."""


def problem_of(error: Exception) -> Problem:
    """The problem that an error is for the client."""
    return next(made(error) for kind, made in _PROBLEMS.items() if isinstance(error, kind))


_PROBLEMS: dict[type[Exception], Callable[[Any], Problem]] = {
    Problem: lambda problem: problem,
    IdempotencyConflict: lambda error: Problem(409, "The idempotency key is taken", str(error)),
    UnknownRun: lambda _error: Problem(404, "No such run", "no run has this id"),
    UnknownBatch: lambda _error: Problem(404, "No such batch", "no batch has this id"),
    DamagedRecord: _damaged,
    InvalidCursor: _cursor,
    StoreFault: store_problem,
    StoreClosed: _stopping,
    ExecutorClosed: _stopping,
    Busy: busy,
    Exception: lambda _error: Problem(500, "Something went wrong", "the request was understood; the fault is here"),
}
"""The problem that each error is for the client."""


def install(app: FastAPI, page: Callable[[Request, Problem], Response | None]) -> None:
    """Register the exception handlers; ``page`` may render a problem as a page instead of JSON."""
    from fastapi.exceptions import RequestValidationError
    from starlette.exceptions import HTTPException
    from starlette.requests import ClientDisconnect
    from starlette.responses import Response
    from starlette.routing import Match

    def methods(request: Request) -> str:
        """All methods of the path (RFC 9110, 10.2.1); the router names those of its first matching route only."""
        scopes = {method: {**request.scope, "method": method} for method in ("GET", "POST", "PUT", "PATCH", "DELETE")}
        return ", ".join(m for m, scope in scopes.items() if any(r.matches(scope)[0] is Match.FULL for r in app.routes))

    # Who is refused before the application is reached is shown the same page.
    app.state.problem_page = page
    problems = {
        **_PROBLEMS,
        # The location begins with the parameter's kind: query, header or path.
        RequestValidationError: lambda error: refusal(error.errors(), depth=1),
        HTTPException: _http,
    }

    def handler(problem_of: Callable[[Any], Problem]) -> Callable[[Request, Any], Awaitable[Response]]:
        async def answer(request: Request, error: Exception) -> Response:
            problem = problem_of(error)
            if problem.status == 405:
                problem.headers["Allow"] = methods(request)
            return page(request, problem) or problem_response(problem)

        return answer

    async def departed(_request: Request, _error: Exception) -> Response:
        return Response(status_code=CLIENT_GONE)

    for kind, problem_of in problems.items():
        app.add_exception_handler(kind, handler(problem_of))
    for kind in (ClientDisconnect, ClientDisconnected):
        app.add_exception_handler(kind, departed)
