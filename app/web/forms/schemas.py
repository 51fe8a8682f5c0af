"""What a form needs from the JSON schema of a field: help text, range, and the tag of a union's member."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.designs.refusals import LIMITS
from app.designs.units import tidy
from app.words.languages import gettext as _
from app.words.units import told

Schema = Mapping[str, Any]
TAGS = ("kind", "method")
"""Names of the fields that discriminate between the members of a union."""
_WIDE = 1e6
"""Limits at least this far from zero are numerical safeguards and are not shown."""
_NARROW = 1e-6
"""Least values of this size are numerical safeguards, too: whatever is meant is positive."""


def is_numbers(schema: Schema) -> bool:
    """Whether the field is a list of numbers other than a range."""
    return schema.get("type") == "array" and schema["items"].get("type") == "number" and schema.get("maxItems") != 2


def tag_of(model: Schema, item: Schema) -> tuple[str, Any]:
    """The tag of a union member and the predicate that recognises its values."""
    for name in TAGS:
        constant = model.get("properties", {}).get(name, {}).get("const")
        if constant is not None:
            return constant, lambda v, n=name, c=constant: isinstance(v, Mapping) and v.get(n) == c
    if model["type"] == "object":
        own = set(model["properties"])
        title = item.get("$ref", "").rpartition("/")[2]
        return title.lower(), lambda v: isinstance(v, Mapping) and bool(v) and set(v) <= own
    if model["type"] == "array":
        return "list", lambda v: isinstance(v, list)
    return "number", lambda v: isinstance(v, (int, float))


def first_sentence(model: Schema) -> str:
    """The first line of a model's description."""
    return model.get("description", "").partition("\n")[0]


def help_of(schema: Schema, nullable: bool) -> str:
    """The field's description, with the meaning of null stated for an empty field."""
    text = schema.get("description", "")
    return text.replace("null:", "empty:") if nullable else text


def allowed(schema: Schema, unit: str) -> str:
    """The range as text, without limits that are numerical safeguards."""
    low, above = schema.get("minimum"), schema.get("exclusiveMinimum")
    high, below = schema.get("maximum"), schema.get("exclusiveMaximum")
    high = None if high is not None and high >= _WIDE else high
    if low is not None and (low <= -_WIDE or 0.0 < low <= _NARROW):
        low = None
    if low is not None and high is not None:
        return f"{bound(low, unit)} … {bound(high, unit)}"
    limits = {"ge": low, "gt": above if low is None else None, "le": high, "lt": below if high is None else None}
    return ", ".join(_(LIMITS[name]).format(bound(x, unit)) for name, x in limits.items() if x is not None)


def bound(value: float, unit: str) -> str:
    """A limit in the displayed unit."""
    return tidy(f"{told(value, unit):g}")
