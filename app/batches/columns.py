"""Columns of result tables: the meaning of a name, and its values in items.

The result's fields have their own names, and so have the request's, except those that the result has, too: these begin
with ``spec.``, so that what was asked for and what was reached are never taken for each other.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from app.batches.fields import forms_of, request_type, result_forms, result_type

OWN = "own"
OWN_TYPES: dict[str, type] = {
    "index": int,
    "line": int,
    "run_id": str,
    "status": str,
    "holds": bool,
    "governed_by": str,
    "accuracy.estimated": float,
    "accuracy.met": bool,
    "diagnosis": str,
    "problem": str,
}
"""Columns of every batch."""

_REQUESTED = "spec."


class Column(NamedTuple):
    """A column, the part of an item that has its values, their dotted path there, and their type."""

    name: str
    part: str
    path: str
    type: type

    def value(self, parts: Mapping[str, Any]) -> Any:
        """The value in an item's parts; objects and arrays as JSON text, None where there is none."""
        found = parts.get(self.part)
        for step in self.path.split("."):
            if isinstance(found, list):
                found = found[int(step)] if step.isdecimal() and int(step) < len(found) else None
            else:
                found = found.get(step) if isinstance(found, dict) else None
        return json.dumps(found, ensure_ascii=False) if isinstance(found, (dict, list)) else found


@lru_cache(maxsize=4096)
def column(kind: str, mode: str, name: str) -> Column | None:
    """The column of a name: of every batch, of the result or of the request; None if there is no such field."""
    if name in OWN_TYPES:
        return Column(name, OWN, name, OWN_TYPES[name])
    if result_forms(kind, mode, name):
        return Column(name, "result", name, result_type(kind, mode, name))
    for field in (name, name.removeprefix(_REQUESTED)):
        if forms_of(kind, mode, field):
            return Column(name, "spec", field, request_type(kind, mode, field))
    return None


@lru_cache(maxsize=4096)
def requested(kind: str, mode: str, field: str) -> Column:
    """The column of a field of the request."""
    own = column(kind, mode, field)
    name = field if own is None or own.part == "spec" else _REQUESTED + field
    return Column(name, "spec", field, request_type(kind, mode, field))
