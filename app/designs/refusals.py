"""Validation errors as problem details (RFC 9457), one entry per invalid field.

Values are never echoed, since JSON cannot represent all of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

from app.designs.nearest import fields_at, nearest
from app.designs.schema import Entry, is_tag
from app.designs.units import figures

MAX_ENTRIES = 100
MAX_POINTER_LENGTH = 500
_MAX_NUMBER_LENGTH = 100
_LIMIT_DIGITS = 12

REQUIRED = "a value: the field is required"
REPEATED = "names appear more than once"

LIMITS = {
    "allowed": "{}",
    "gt": "more than {}",
    "ge": "at least {}",
    "lt": "less than {}",
    "le": "at most {}",
    "min_length": "no fewer than {}",
    "max_length": "no more than {}",
    "expected": "{}",
}
ALLOWED_BY_TYPE = {
    "finite_number": "a finite number",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing_size": "a whole number of fewer digits",
    "multiple_of": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a string",
    "string_unicode": "text of whole Unicode characters, without lone surrogates",
    "string_pattern_mismatch": "no NUL character",
    "list_type": "an array",
    "tuple_type": "an array",
    "missing": REQUIRED,
    "model_type": "an object",
    "model_attributes_type": "an object",
    "dict_type": "an object",
    "json_invalid": "one well-formed JSON value in UTF-8",
    "datetime_parsing": "a time such as 2026-01-31T12:00:00Z",
    "datetime_from_date_parsing": "a time such as 2026-01-31T12:00:00Z",
    "timezone_aware": "a time with its zone, such as 2026-01-31T12:00:00Z",
}

SAID_BY_TYPE = {
    "missing": "is missing",
    "finite_number": "is not a finite number",
    "float_type": "is not a number",
    "float_parsing": "is not a number",
    "int_type": "is not a whole number",
    "int_parsing": "is not a whole number",
    "int_from_float": "is not a whole number",
    "int_parsing_size": "has too many digits",
    "multiple_of": "is not a whole number",
    "bool_type": "is neither true nor false",
    "bool_parsing": "is neither true nor false",
    "string_type": "is not a string",
    "string_unicode": "is not valid Unicode",
    "list_type": "is not an array",
    "tuple_type": "is not an array",
    "model_type": "is not an object",
    "model_attributes_type": "is not an object",
    "dict_type": "is not an object",
    "datetime_parsing": "is not a time",
    "datetime_from_date_parsing": "is not a time",
    "too_short": "has too few items",
    "too_long": "has too many items",
    "string_too_short": "has too few characters",
    "string_too_long": "has too many characters",
    "string_pattern_mismatch": "has a character that is not allowed",
    "literal_error": "is none of the values it can have",
    "enum": "is none of the values it can have",
    "extra_forbidden": "is no field",
}
_WORD = re.compile(r"[\w.-]+")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*")


def summarize(errors: Iterable[Mapping[str, Any]], depth: int = 0, model: Any = None) -> tuple[str, list[Entry]]:
    """A summary and one entry per invalid field: pointer, detail, allowed values.

    ``depth`` leading parts of each location are dropped. With the validating ``model``, unknown names get a suggestion.
    Only the first ``MAX_ENTRIES`` errors are listed.
    """
    found = list(errors)
    entries = [_entry(item, depth, model) for item in found[:MAX_ENTRIES]]
    fields = "1 field" if len(found) == 1 else f"{len(found)} fields"
    return f"{fields} cannot be accepted", entries


def _entry(item: Mapping[str, Any], depth: int, model: Any) -> Entry:
    context = item.get("ctx", {})
    limits = [text.format(_written(context[key])) for key, text in LIMITS.items() if key in context]
    allowed = ", ".join(limits) or ALLOWED_BY_TYPE.get(item["type"], "see the contract")
    parts = [part for part in item["loc"][depth:] if not is_tag(part)]
    detail = SAID_BY_TYPE.get(item["type"], item["msg"])
    if item["type"].startswith(("greater_than", "less_than")):
        detail = "is out of range"
    elif detail == "is not a number" and isinstance(given := item.get("input"), str):
        if _DECIMAL_COMMA.fullmatch(given[:_MAX_NUMBER_LENGTH]):
            detail, allowed = "is text with a decimal comma", "a number with a decimal point and without quotes"
        else:
            detail, allowed = "is text", "a number, without quotes"
    elif item["type"] == "extra_forbidden":
        allowed = ", ".join(fields_at(model, item["loc"][:-1])) or "the fields of this object"
        detail = with_suggestion(detail, item["loc"][-1], _WORD.findall(allowed))
    elif item["type"] in ("literal_error", "enum"):
        detail = with_suggestion(detail, item.get("input"), _WORD.findall(allowed))
    elif item["type"] == "one_of" and "field" in context and isinstance(given := item.get("input"), Mapping):
        parts, allowed = [*parts, context["field"]], context["names"]
        detail = SAID_BY_TYPE["literal_error"] if context["field"] in given else SAID_BY_TYPE["missing"]
        detail = with_suggestion(detail, given.get(context["field"]), _WORD.findall(allowed))
    return {"pointer": json_pointer(parts), "detail": detail, "allowed": allowed}


def _written(limit: Any) -> Any:
    return figures(limit, _LIMIT_DIGITS) if isinstance(limit, float) else limit


def repetitions(paths: Iterable[Iterable[int | str]]) -> list[Entry]:
    """One entry per name that appears more than once in its object."""
    found = islice(map(json_pointer, paths), MAX_ENTRIES)
    return [{"pointer": pointer, "detail": "appears more than once", "allowed": "each name once"} for pointer in found]


def with_suggestion(detail: str, given: Any, allowed: Iterable[str]) -> str:
    """The detail, with the most similar allowed word as a suggestion."""
    meant = nearest(given, allowed) if isinstance(given, str) else None
    return detail if meant in (None, given) else f"{detail}; did you mean {meant}?"


def json_pointer(parts: Iterable[int | str]) -> str:
    """A JSON pointer (RFC 6901), truncated for excessively long names; lone surrogates, which UTF-8 does not have, are
    question marks."""
    found = "".join(f"/{str(part).replace('~', '~0').replace('/', '~1')}" for part in parts)[:MAX_POINTER_LENGTH]
    return found.encode("utf-8", "replace").decode()
