"""Request bodies: read once, bounded, validated straight from their bytes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

from pydantic import ValidationError

from app.designs.problems import INVALID
from app.designs.refusals import json_pointer
from app.designs.schema import Entry, entry
from app.errors import Problem, invalid

if TYPE_CHECKING:
    from fastapi import Request


class Body(Protocol):
    """What a request model must offer: a pydantic model that can see what single fields cannot."""

    @classmethod
    def model_validate_json(cls, json_data: bytes) -> Self: ...

    def contradictions(self) -> list[Entry]: ...


M = TypeVar("M", bound=Body)


async def read_body(request: Request) -> bytes:
    """The body's bytes, bounded by the edge; 415 unless it is JSON."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise Problem(415, "Not JSON", "send application/json")
    body = await request.body()
    most = request.app.state.settings.max_body_names
    # Faults are found one by one, so there must not be endlessly many. Colons in texts count too: texts are short.
    if body.count(b":") > most:
        raise Problem(422, INVALID, f"at most {most} fields are accepted")
    return body


def parse(model: type[M], body: bytes) -> M:
    """The request in a body, or Problem 422 with one entry per bad field."""
    try:
        request = model.model_validate_json(body)
    except ValidationError as error:
        raise invalid(error, model) from None
    if repeated := _repeated_names(body):
        raise Problem(422, INVALID, "names appear more than once", repeated)
    if contradictions := request.contradictions():
        raise Problem(422, INVALID, "values contradict each other", contradictions)
    return request


class _Repeating(dict[str, Any]):
    """A JSON object in which some names appear more than once."""

    names: list[str]


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    repeating, seen = _Repeating(found), set()
    repeating.names = [name for name, _ in pairs if name in seen or seen.add(name)]
    return repeating


def _repeated_names(body: bytes) -> list[Entry]:
    """One entry per name that an object has twice: validation takes the last one, the sender may have meant the first.

    For bodies that are valid otherwise: their depth is that of the model.
    """
    found: list[Entry] = []

    def look(value: Any, path: tuple[int | str, ...]) -> None:
        if isinstance(value, _Repeating):
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
        repeats = repeats or isinstance(built, _Repeating)
        return built

    # Numbers stay text: none is looked at, and Python refuses integers of more than 4300 digits.
    content = json.loads(body, object_pairs_hook=build, parse_int=str, parse_float=str)
    if repeats:
        look(content, ())
    return found
