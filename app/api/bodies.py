"""Request bodies: read with limits and validated directly from their bytes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

from pydantic import ValidationError
from pydantic_core import from_json, to_json

from app.designs.problems import INVALID
from app.designs.refusals import json_pointer
from app.designs.schema import Entry, entry
from app.edge.asgi import header
from app.edge.disconnect import ClientDisconnected
from app.errors import Problem, invalid

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
    if repeated := _duplicate_names(body):
        raise Problem(422, INVALID, "names appear more than once", repeated)
    if contradictions := request.contradictions():
        raise Problem(422, INVALID, "values contradict each other", contradictions)
    return request


class _ObjectWithDuplicates(dict[str, Any]):
    """A JSON object with duplicate names."""

    names: list[str]


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    repeating, seen = _ObjectWithDuplicates(found), set()
    repeating.names = [name for name, _ in pairs if name in seen or seen.add(name)]
    return repeating


def _duplicate_names(body: bytes) -> list[Entry]:
    """One entry per duplicate name: validation takes the last value, but the sender may have meant the first.

    Only for otherwise valid bodies, whose depth is bounded by the model. A body without escapes is tested quickly:
    every string has two quotes, and those of a duplicate name are missing when the parsed body is serialized again.
    """
    if b"\\" not in body and body.count(b'"') == to_json(from_json(body)).count(b'"'):
        return []
    found: list[Entry] = []

    def look(value: Any, path: tuple[int | str, ...]) -> None:
        if isinstance(value, _ObjectWithDuplicates):
            found.extend(
                entry(json_pointer((*path, name)), "appears more than once", "each name once") for name in value.names
            )
        children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for name, child in children:
            look(child, (*path, name))

    repeats = False

    def build(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        nonlocal repeats
        built = _object(pairs)
        repeats = repeats or isinstance(built, _ObjectWithDuplicates)
        return built

    # Numbers stay strings: they are not needed, and Python refuses integers of more than 4300 digits.
    content = json.loads(body, object_pairs_hook=build, parse_int=str, parse_float=str)
    if repeats:
        look(content, ())
    return found
