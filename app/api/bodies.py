"""Request bodies: read with limits and validated directly from their bytes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Protocol, Self, TypeVar

from pydantic import ValidationError
from pydantic_core import from_json, to_json

from app.designs.problems import INVALID
from app.designs.refusals import REPEATED, repetitions
from app.designs.schema import Entry
from app.edge.asgi import header
from app.edge.disconnect import ClientDisconnected
from app.errors import Problem, invalid
from app.repeated_names import as_object, repeated

if TYPE_CHECKING:
    from fastapi import Request


class Body(Protocol):
    """Interface of request models: a pydantic model with cross-field validation."""

    @classmethod
    def model_validate_json(cls, json_data: bytes) -> Self: ...

    def contradictions(self) -> list[Entry]: ...


M = TypeVar("M", bound=Body)

_LARGE_BYTES = 16_384
"""Size above which validation takes more than about a millisecond."""


async def read_body(request: Request) -> bytes:
    """The body's bytes. Raises Problem 415 unless it is JSON, 422 if it has too many fields."""
    kind = header(request.scope, b"content-type") or b""
    if kind.partition(b";")[0].strip().lower() != b"application/json":
        raise Problem(415, "Not JSON", "send application/json")
    body = await _received(request)
    maximum = request.app.state.settings.max_body_names
    # Validation reports errors one by one, so their number must be bounded. Colons in strings count too, but strings
    # are short.
    if body.count(b":") > maximum:
        raise Problem(422, INVALID, f"at most {maximum} fields are accepted")
    return body


async def _received(request: Request) -> bytes:
    """The whole body, in a fifth of the steps of Starlette's stream. Raises ClientDisconnected."""
    parts, more = [], True
    while more:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            raise ClientDisconnected
        parts.append(message.get("body", b""))
        more = message.get("more_body", False)
    return b"".join(parts)


async def parse_in_turn(request: Request, model: type[M], body: bytes) -> M:
    """Like ``parse``; a large body waits for its turn."""
    if len(body) > _LARGE_BYTES:
        await request.app.state.large_bodies.turn()
    return parse(model, body)


def parse(model: type[M], body: bytes) -> M:
    """Parse and validate a body. Raises Problem 422 with one entry per invalid field."""
    try:
        request = model.model_validate_json(body)
    except ValidationError as error:
        raise invalid(error, model) from None
    if entries := _repeated_names(body):
        raise Problem(422, INVALID, REPEATED, entries)
    if contradictions := request.contradictions():
        raise Problem(422, INVALID, "values contradict each other", contradictions)
    return request


def _repeated_names(body: bytes) -> list[Entry]:
    """One entry per repeated name.

    Only for otherwise valid bodies, whose depth is bounded by the model. A body without escapes is tested quickly:
    every string has two quotes, and those of a repeated name are missing when the parsed body is serialized again.
    """
    if b"\\" not in body and body.count(b'"') == to_json(from_json(body)).count(b'"'):
        return []
    # Numbers stay strings: they are not needed, and Python refuses integers of more than 4300 digits.
    content = json.loads(body, object_pairs_hook=as_object, parse_int=str, parse_float=str)
    return repetitions(repeated(content))
