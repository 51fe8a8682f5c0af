"""What a request model found wrong, as problem details (RFC 9457): one entry per bad field.

Values are never echoed, for JSON cannot carry them all.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from app.designs.schema import Entry, is_tag

INVALID = "The request is not valid"
MOST_ENTRIES = 100
LONGEST_POINTER = 500

LIMITS = {
    "allowed": "{}",
    "gt": "more than {}",
    "ge": "at least {}",
    "lt": "less than {}",
    "le": "at most {}",
    "min_length": "at least {} long",
    "max_length": "at most {} long",
    "expected": "{}",
}
ALLOWED_BY_TYPE = {
    "finite_number": "a finite number",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "a string",
    "string_pattern_mismatch": "no NUL character",
    "list_type": "an array",
    "missing": "this field",
    "extra_forbidden": "only the fields of the contract",
    "model_type": "an object",
    "model_attributes_type": "an object",
    "json_invalid": "one well-formed JSON value in UTF-8",
    "datetime_parsing": "a time such as 2026-01-31T12:00:00Z",
    "datetime_from_date_parsing": "a time such as 2026-01-31T12:00:00Z",
    "timezone_aware": "a time with its zone, such as 2026-01-31T12:00:00Z",
}


def summed_up(errors: Iterable[Mapping[str, Any]], depth: int = 0) -> tuple[str, list[Entry]]:
    """A sentence and one entry per bad field: pointer, what is wrong, what is allowed; ``depth`` parts of each location
    are dropped.

    A request can be wrong in ten thousand places; the first hundred are told.
    """
    found = list(errors)
    entries = [_entry(item, depth) for item in found[:MOST_ENTRIES]]
    fields = "1 field" if len(found) == 1 else f"{len(found)} fields"
    return f"{fields} cannot be accepted", entries


def _entry(item: Mapping[str, Any], depth: int) -> Entry:
    context = item.get("ctx", {})
    limits = [text.format(context[key]) for key, text in LIMITS.items() if key in context]
    allowed = ", ".join(limits) or ALLOWED_BY_TYPE.get(item["type"], "see the contract")
    parts = [part for part in item["loc"][depth:] if not is_tag(part)]
    ranged = item["type"].startswith(("greater_than", "less_than"))
    return {"pointer": json_pointer(parts), "detail": "is out of range" if ranged else item["msg"], "allowed": allowed}


def json_pointer(parts: Iterable[int | str]) -> str:
    """RFC 6901, cut where a client sent a monster of a name."""
    return "".join(f"/{str(part).replace('~', '~0').replace('/', '~1')}" for part in parts)[:LONGEST_POINTER]
