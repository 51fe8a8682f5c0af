"""Dotted names against a request's schema: whether a field can be meant, and whether its cells are text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from app.designs.kind import Mode
from app.designs.registry import KINDS, job_of

MOST_COLUMNS = 500


@cache
def _schema(kind: str, mode: str) -> dict[str, Any]:
    return job_of(KINDS[kind], Mode(mode)).request.model_json_schema()


def _forms(root: dict[str, Any], node: dict[str, Any], depth: int = 0) -> Iterator[dict[str, Any]]:
    """Every form that a value there can have."""
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
    elif step.isdigit() and node.get("type") == "array":
        members = node.get("prefixItems", [])
        item = members[int(step)] if int(step) < len(members) else node.get("items")
        if isinstance(item, dict):
            yield from _forms(root, item)


def forms_of(kind: str, mode: str, name: str) -> list[dict[str, Any]]:
    """What the schema says of the field with that dotted name; empty where there is no such field."""
    root = _schema(kind, mode)
    nodes = list(_forms(root, root))
    for step in name.split(".")[:50]:
        nodes = [inner for node in nodes for inner in _inner(root, node, step)]
    return nodes


def unknown(kind: str, mode: str, names: Iterable[str]) -> list[str]:
    """Those of the names that are no field."""
    return [name for name in names if not forms_of(kind, mode, name)]


def texts(kind: str, mode: str, names: Iterable[str]) -> frozenset[str]:
    """Those of the fields that hold nothing but text, so that a cell that looks like a number is none."""
    return frozenset(name for name in names if all(_is_text(form) for form in forms_of(kind, mode, name)))


def _is_text(form: dict[str, Any]) -> bool:
    return form.get("type") == "string" or isinstance(form.get("const"), str)


@cache
def result_columns(kind: str, mode: str) -> dict[str, type]:
    """The dotted names of all scalars that a result of that kind and mode can have, with the types of their values."""
    job = job_of(KINDS[kind], Mode(mode))
    found: dict[str, type] = {}

    def walk(root: dict[str, Any], node: dict[str, Any], path: tuple[str, ...]) -> None:
        for form in _forms(root, node):
            kind_of = _TYPES.get(form.get("type", ""))
            if kind_of is not None and path:
                name = ".".join(path)
                found[name] = wider(found.get(name, kind_of), kind_of)
            if len(path) < _DEEPEST:
                for name, inner in form.get("properties", {}).items():
                    walk(root, inner, (*path, name))

    schema = job.result.model_json_schema(mode="serialization")
    walk(schema, schema, ())
    return found


_TYPES: dict[str, type] = {"number": float, "integer": int, "boolean": bool, "string": str}
_DEEPEST = 5


def wider(one: type, other: type) -> type:
    """A type that holds the values of both."""
    if one is other or other is type(None):
        return one
    if one is type(None):
        return other
    return float if {one, other} == {int, float} else str


def numbers(kind: str, mode: str) -> list[str]:
    """The dotted names of all numeric fields that can be varied, in the order of the schema."""
    root = _schema(kind, mode)
    found: dict[str, None] = {}

    def walk(node: dict[str, Any], path: tuple[str, ...]) -> None:
        if len(path) > 4:
            return
        for form in _forms(root, node):
            if form.get("type") in ("number", "integer") and path:
                found[".".join(path)] = None
            for name, inner in form.get("properties", {}).items():
                walk(inner, (*path, name))

    walk(root, ())
    return list(found)
