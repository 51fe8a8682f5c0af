"""Problem details (RFC 9457): the one shape in which the service says no."""

from __future__ import annotations

import json
from typing import Any

from fastapi import FastAPI, Request
from fastapi.responses import Response
from pydantic import ValidationError
from starlette.exceptions import HTTPException

from app.jobs.errors import Busy, ExecutorClosed
from app.store.errors import IdempotencyConflict, InvalidCursor, UnknownRun

MEDIA_TYPE = "application/problem+json"

_LIMITS = {
    "gt": "more than {}",
    "ge": "at least {}",
    "lt": "less than {}",
    "le": "at most {}",
    "min_length": "at least {} long",
    "max_length": "at most {} long",
    "expected": "{}",
    "expected_tags": "{}",
}
_ALLOWED_BY_TYPE = {
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "a string",
    "list_type": "an array",
    "missing": "this field",
    "extra_forbidden": "only the fields of the contract",
    "model_type": "an object",
    "model_attributes_type": "an object",
    "json_invalid": "one well-formed JSON value in UTF-8",
}


class Problem(Exception):
    """A refusal on its way to the client."""

    def __init__(self, status: int, title: str, detail: str, errors: list[dict[str, Any]] | None = None) -> None:
        super().__init__(detail)
        self.status = status
        self.body = {"type": "about:blank", "title": title, "status": status, "detail": detail}
        if errors is not None:
            self.body["errors"] = errors


def problem_response(body: dict[str, Any]) -> Response:
    """A response that carries a problem; its status is the problem's own."""
    # ASCII only: a lone surrogate in a field's name cannot be encoded as UTF-8, but can be escaped.
    return Response(json.dumps(body, allow_nan=False), status_code=body["status"], media_type=MEDIA_TYPE)


def invalid(error: ValidationError) -> Problem:
    """One entry per bad field: pointer, what is wrong, what is allowed. Values are never echoed."""
    errors = []
    for item in error.errors(include_url=False, include_input=False):
        limits = [text.format(item["ctx"][key]) for key, text in _LIMITS.items() if key in item.get("ctx", {})]
        allowed = ", ".join(limits) or _ALLOWED_BY_TYPE.get(item["type"], "see the contract")
        pointer = "".join(f"/{str(part).replace('~', '~0').replace('/', '~1')}" for part in _path(item["loc"]))
        errors.append({"pointer": pointer, "detail": item["msg"], "allowed": allowed})
    return Problem(422, "The request is not valid", f"{len(errors)} field(s) cannot be accepted", errors)


def _path(loc: tuple[int | str, ...]) -> list[int | str]:
    """The field's path without the names of union members that pydantic weaves into it."""
    return [part for part in loc if not (isinstance(part, str) and (part[:1].isupper() or part in _UNION_TAGS))]


_UNION_TAGS = frozenset({"schmidt", "table", "constant", "literal['auto','all']", "function-after"})


def install(app: FastAPI) -> None:
    """Answer every refusal of the service with problem details."""

    @app.exception_handler(Problem)
    async def _problem(_: Request, problem: Problem) -> Response:
        return problem_response(problem.body)

    @app.exception_handler(HTTPException)
    async def _http(_: Request, error: HTTPException) -> Response:
        response = problem_response(Problem(error.status_code, str(error.detail), str(error.detail)).body)
        response.headers.update(error.headers or {})
        return response

    @app.exception_handler(IdempotencyConflict)
    async def _conflict(_: Request, error: IdempotencyConflict) -> Response:
        return problem_response(Problem(409, "The idempotency key is taken", str(error)).body)

    @app.exception_handler(UnknownRun)
    async def _unknown(_: Request, error: UnknownRun) -> Response:
        return problem_response(Problem(404, "No such run", "no run has this id").body)

    @app.exception_handler(InvalidCursor)
    async def _cursor(_: Request, error: InvalidCursor) -> Response:
        entry = {"pointer": "/cursor", "detail": str(error), "allowed": "the next_cursor of an earlier page"}
        return problem_response(Problem(422, "The request is not valid", str(error), [entry]).body)

    @app.exception_handler(Busy)
    @app.exception_handler(ExecutorClosed)
    async def _busy(_: Request, error: Exception) -> Response:
        response = problem_response(Problem(503, "Too much work waits", str(error)).body)
        response.headers["Retry-After"] = "1"
        return response

    @app.exception_handler(Exception)
    async def _unforeseen(_: Request, error: Exception) -> Response:
        return problem_response(
            Problem(500, "Something went wrong", "the request was understood; the fault is here").body
        )
