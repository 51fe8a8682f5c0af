"""Resolves dotted field names against the JSON schema of a request or result."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of

MOST_COLUMNS = 500
_INDEX = re.compile(r"[0-9]{1,9}")


@cache
def _schema(kind: str, mode: str) -> dict[str, Any]:
    return job_of(KINDS[kind], Mode(mode)).request.model_json_schema()


def _forms(root: dict[str, Any], node: dict[str, Any], depth: int = 0) -> Iterator[dict[str, Any]]:
    """The alternative subschemas of a node, with references resolved."""
    if depth > 20:
        return
    if "$ref" in node:
        yield from _forms(root, root["$defs"][node["$ref"].rpartition("/")[2]], depth + 1)
    members = [member for word in ("anyOf", "oneOf", "allOf") for member in node.get(word, ())]
    for member in members:
        yield from _forms(root, member, depth + 1)
    if "$ref" not in node and not members:
        yield node


def _inner(root: dict[str, Any], node: dict[str, Any], step: str) -> Iterator[dict[str, Any]]:
    if step in node.get("properties", {}):
        yield from _forms(root, node["properties"][step])
    elif isinstance(node.get("additionalProperties"), dict):
        yield from _forms(root, node["additionalProperties"])
    elif _INDEX.fullmatch(step) and node.get("type") == "array":
        members = node.get("prefixItems", [])
        item = members[int(step)] if int(step) < len(members) else node.get("items")
        if isinstance(item, dict):
            yield from _forms(root, item)


def forms_of(kind: str, mode: str, name: str) -> list[dict[str, Any]]:
    """The subschemas of the field with a dotted name; empty if there is no such field."""
    return _at(_schema(kind, mode), name)


def _at(root: dict[str, Any], name: str) -> list[dict[str, Any]]:
    nodes = list(_forms(root, root))
    for step in name.split(".")[:50]:
        nodes = [inner for node in nodes for inner in _inner(root, node, step)]
    return nodes


def unknown(kind: str, mode: str, names: Iterable[str]) -> list[str]:
    """The names that are not fields of the request."""
    return [name for name in names if not forms_of(kind, mode, name)]


def texts(kind: str, mode: str, names: Iterable[str]) -> frozenset[str]:
    """The text-only fields, whose cells are never parsed as numbers."""
    return frozenset(name for name in names if all(_is_text(form) for form in forms_of(kind, mode, name)))


def _is_text(form: dict[str, Any]) -> bool:
    return form.get("type") == "string" or isinstance(form.get("const"), str)


@cache
def _result_schema(kind: str, mode: str) -> dict[str, Any]:
    return job_of(KINDS[kind], Mode(mode)).result.model_json_schema(mode="serialization")


def result_forms(kind: str, mode: str, name: str) -> list[dict[str, Any]]:
    """The subschemas of a field of the result; empty if there is no such field."""
    return _at(_result_schema(kind, mode), name)


@cache
def result_columns(kind: str, mode: str) -> dict[str, type]:
    """The dotted names and types of all scalars that a result of this kind and mode may contain."""
    found: dict[str, type] = {}

    def walk(root: dict[str, Any], node: dict[str, Any], path: tuple[str, ...]) -> None:
        for form in _forms(root, node):
            kind_of = _TYPES.get(form.get("type", ""))
            if kind_of is not None and path:
                name = ".".join(path)
                found[name] = wider(found.get(name, kind_of), kind_of)
            if len(path) < _MAX_DEPTH:
                for name, inner in form.get("properties", {}).items():
                    walk(root, inner, (*path, name))

    schema = _result_schema(kind, mode)
    walk(schema, schema, ())
    return found


def request_type(kind: str, mode: str, name: str) -> type:
    """The type of the scalars that a field of the request may have; text if it has none."""
    return _scalar_type(forms_of(kind, mode, name))


def result_type(kind: str, mode: str, name: str) -> type:
    """The type of the scalars that a field of the result may have; text if it has none."""
    return _scalar_type(result_forms(kind, mode, name))


def _scalar_type(forms: Iterable[dict[str, Any]]) -> type:
    found: type = type(None)
    for form in forms:
        found = wider(found, _TYPES.get(form.get("type", ""), type(None)))
    return str if found is type(None) else found


_TYPES: dict[str, type] = {"number": float, "integer": int, "boolean": bool, "string": str}
_MAX_DEPTH = 5


def wider(one: type, other: type) -> type:
    """The common type of two column types; ``NoneType`` is neutral."""
    if one is other or other is type(None):
        return one
    if one is type(None):
        return other
    return float if {one, other} == {int, float} else str


def numbers(kind: str, mode: str) -> list[str]:
    """The dotted names of all numeric fields that can be varied, in schema order."""
    return [name for name, types in _types(kind, mode).items() if types & {"number", "integer"}]


def names(kind: str, mode: str) -> list[str]:
    """The dotted names of all fields of the request, in schema order."""
    return list(_types(kind, mode))


@cache
def _types(kind: str, mode: str) -> dict[str, set[str]]:
    """The JSON types of all fields by dotted name, but for those inside arrays."""
    root = _schema(kind, mode)
    found: dict[str, set[str]] = {}

    def walk(node: dict[str, Any], path: tuple[str, ...]) -> None:
        if len(path) > 4:
            return
        for form in _forms(root, node):
            if path:
                found.setdefault(".".join(path), set()).add(form.get("type", ""))
            for name, inner in form.get("properties", {}).items():
                walk(inner, (*path, name))

    walk(root, ())
    return found
