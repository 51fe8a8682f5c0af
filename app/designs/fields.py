"""Field-by-field description of a kind's requests, from the request models' JSON schemas and the forms' wording.

For clients that build their own forms.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from pydantic import BaseModel, Field

from app.designs.form import COMMON, look_up
from app.designs.kind import Kind, Mode
from app.designs.registry import job_of
from app.designs.units import split_unit

_TAGS = ("kind", "method")
_MAX_DEPTH = 6


class FieldInfo(BaseModel):
    """A field of a request. Limits are null if there are none."""

    path: str = Field(description="dotted names; [] for the items of a list")
    label: str
    unit: str
    type: str = Field(
        description="number, integer, string, boolean, choice, list, or form (a choice between objects, which "
        "is not a field itself)"
    )
    required: bool = Field(
        description="whether its object requires the field; of a chosen form only its own fields are required"
    )
    nullable: bool
    default: Any = Field(description="null: no limit")
    minimum: float | None
    maximum: float | None
    exclusive_minimum: bool
    exclusive_maximum: bool
    items: str | None = Field(description="lists only: the type of the items, to which the limits apply")
    least_items: int | None
    most: int | None = Field(description="number of characters of a string, or of items of a list")
    choices: list[str | float] | None
    when: str = Field(
        description="the forms in which the field exists, such as load.kind=schmidt, or material=custommaterial "
        "where the fields alone identify a form; empty: in every form"
    )
    help: str


@cache
def fields_of(kind: Kind, mode: Mode) -> tuple[FieldInfo, ...]:
    """All fields of a mode's requests in the models' order; a discriminator comes before its fields."""
    schema = job_of(kind, mode).request.model_json_schema()
    return tuple(_Reader(kind, schema).object_fields(schema, "", "", 0))


def objectives_of(kind: Kind) -> list[str]:
    """Objectives of a design; empty if there is only one."""
    if Mode.DESIGN not in kind.jobs:
        return []
    return next(
        ([str(choice) for choice in f.choices or ()] for f in fields_of(kind, Mode.DESIGN) if f.path == "objective"), []
    )


class _Reader:
    def __init__(self, kind: Kind, root: Mapping[str, Any]) -> None:
        self._words, self._definitions = kind.form, root.get("$defs", {})

    def object_fields(self, schema: Mapping[str, Any], path: str, when: str, depth: int) -> Iterator[FieldInfo]:
        """The fields of an object, or of the selected member of a union."""
        if "oneOf" in schema:
            yield from self._forms(schema, path, when, True, depth)
            return
        required = schema.get("required", ())
        for name, part in schema.get("properties", {}).items():
            here = f"{path}.{name}" if path else name
            yield from self._fields(part, here, when, name in required, depth + 1)

    def _fields(
        self, schema: Mapping[str, Any], path: str, when: str, required: bool, depth: int
    ) -> Iterator[FieldInfo]:
        schema, nullable = self._plain(schema)
        if depth > _MAX_DEPTH or schema.get("description", "").startswith("filled in"):
            return
        if "oneOf" in schema:
            yield from self._forms(schema, path, when, required, depth)
        elif "properties" in schema:
            yield from self.object_fields(schema, path, when, depth)
        else:
            yield self._field(schema, path, when, required, nullable)
            items, _ = self._plain(schema.get("items", {}))
            if "properties" in items:
                yield from self.object_fields(items, f"{path}[]", when, depth)

    def _plain(self, schema: Mapping[str, Any]) -> tuple[Mapping[str, Any], bool]:
        """The schema with references resolved and null removed; whether null was allowed."""
        if "$ref" in schema:
            schema = {**self._definitions[schema["$ref"].rpartition("/")[2]], **_without(schema, "$ref")}
        if "anyOf" not in schema:
            return schema, False
        members = [member for member in schema["anyOf"] if member.get("type") != "null"]
        found, _ = self._plain({**members[0], **_without(schema, "anyOf")})
        return found, len(members) < len(schema["anyOf"])

    def _forms(
        self, schema: Mapping[str, Any], path: str, when: str, required: bool, depth: int
    ) -> Iterator[FieldInfo]:
        """The discriminator of a union, and the fields of each member."""
        forms: dict[str, Mapping[str, Any]] = {}
        for member in schema["oneOf"]:
            found, _ = self._plain(member)
            forms |= dict.fromkeys(_names(found), found)
        tag = next((tag for tag in _TAGS if all(_const(member, tag) for member in forms.values())), "")
        place = f"{path}.{tag}".strip(".") if tag else path
        choice = {"type": "string" if tag else "form", "enum": list(forms), **_kept(schema)}
        yield self._field(choice, place, when, required, False)
        for name, member in forms.items():
            inner = f"{when}, {place}={name}" if when else f"{place}={name}"
            if "properties" in member:
                fields = {**member, "properties": {n: p for n, p in member["properties"].items() if n != tag}}
                yield from self.object_fields(fields, path, inner, depth)
            elif "enum" not in member:
                yield self._field({**_kept(schema), **member}, path, inner, required, False)

    def _field(self, schema: Mapping[str, Any], path: str, when: str, required: bool, nullable: bool) -> FieldInfo:
        place = path.replace("[]", "")
        _, unit = split_unit(place.rpartition(".")[2])
        choices = schema.get("enum") or ([schema["const"]] if "const" in schema else None)
        json_type = schema.get("type", "string")
        kind = (
            json_type if json_type == "form" else "choice" if choices else "list" if json_type == "array" else json_type
        )
        items, _ = self._plain(schema.get("items", {}))
        limits = items if kind == "list" else schema
        return FieldInfo(
            path=path,
            label=self._words.label(place),
            unit=unit,
            type=kind,
            required=required,
            nullable=nullable,
            default=schema.get("default", schema.get("const")),
            minimum=limits.get("minimum", limits.get("exclusiveMinimum")),
            maximum=limits.get("maximum", limits.get("exclusiveMaximum")),
            exclusive_minimum="exclusiveMinimum" in limits,
            exclusive_maximum="exclusiveMaximum" in limits,
            items=items.get("type", "object") if kind == "list" else None,
            least_items=schema.get("minItems"),
            most=schema.get("maxLength", schema.get("maxItems")),
            choices=choices,
            when=when,
            help=look_up(self._words.helps, COMMON.helps, place) or schema.get("description", ""),
        )


def _without(schema: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {key: value for key, value in schema.items() if key != name}


def _kept(schema: Mapping[str, Any]) -> dict[str, Any]:
    return {key: schema[key] for key in ("default", "description") if key in schema}


def _const(member: Mapping[str, Any], tag: str) -> Any:
    return member.get("properties", {}).get(tag, {}).get("const")


def _names(member: Mapping[str, Any]) -> list[str]:
    """Values of a union member's tag: its constant, its enumeration, or its model's name."""
    if "enum" in member:
        return [str(word) for word in member["enum"]]
    for tag in _TAGS:
        if _const(member, tag):
            return [str(_const(member, tag))]
    return [str(member.get("title", member.get("type", ""))).lower()]
