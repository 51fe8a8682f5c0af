"""Request bodies: read once, bounded, validated straight from their bytes."""

from __future__ import annotations

from typing import TypeVar

from fastapi import Request
from pydantic import ValidationError

from app.designs.schema import SolverRequest
from app.errors import Problem, invalid

M = TypeVar("M", bound=SolverRequest)


async def read_body(request: Request) -> bytes:
    """The body's bytes; 413 as soon as it exceeds the limit, 415 unless it is JSON."""
    limit = request.app.state.settings.max_body_bytes
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise Problem(415, "Not JSON", "send application/json")
    chunks, size = [], 0
    async for chunk in request.stream():
        size += len(chunk)
        if size > limit:
            raise Problem(413, "The request is too large", f"at most {limit} bytes are accepted")
        chunks.append(chunk)
    return b"".join(chunks)


def parse(model: type[M], body: bytes) -> M:
    """The request in a body, or Problem 422 with one entry per bad field."""
    try:
        request = model.model_validate_json(body)
    except ValidationError as error:
        raise invalid(error) from None
    if contradictions := request.contradictions():
        raise Problem(422, "The request is not valid", "values contradict each other", contradictions)
    return request
