"""GET /docs: API reference page rendered from the OpenAPI document, without third-party assets."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from app.designs.problems import MEANINGS, anchor
from app.web.rendering import page

router = APIRouter(include_in_schema=False)
_MAX_DEPTH = 6
_PROBLEMS = [{"id": anchor(title), "title": title, "meaning": meaning} for title, meaning in MEANINGS.items()]


@router.get("/docs")
async def reference(request: Request) -> HTMLResponse:
    """Every operation with its parameters, fields, example and responses."""
    document = request.app.openapi()
    return page(
        request, "reference.html", document=document, operations=list(_operations(document)), problems=_PROBLEMS
    )


def _operations(document: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            body = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
            example = body.get("example")
            yield {
                "id": f"{method}-{path.strip('/').replace('/', '-').replace('{', '').replace('}', '')}",
                "method": method.upper(),
                "path": path,
                "summary": operation.get("summary", ""),
                "description": operation.get("description", ""),
                "parameters": operation.get("parameters", []),
                "fields": list(_fields(body.get("schema", {}), document)) if body else [],
                "example": json.dumps(example, indent=2, ensure_ascii=False) if example else "",
                "responses": {status: each.get("description", "") for status, each in operation["responses"].items()},
            }


def _fields(schema: Mapping[str, Any], document: Mapping[str, Any], path: str = "") -> Iterator[dict[str, str]]:
    """The fields of a request schema as dotted names, including those of every alternative."""
    if path.count(".") > _MAX_DEPTH:
        return
    for form in _forms(schema, document):
        needed = form.get("required", [])
        for name, inner in form.get("properties", {}).items():
            dotted = f"{path}{name}"
            yield {
                "name": dotted,
                "needed": "yes" if name in needed else "",
                "limits": _limits(inner, document),
                "help": inner.get("description", ""),
            }
            yield from _fields(inner.get("items", inner), document, f"{dotted}.")


def _forms(schema: Mapping[str, Any], document: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    if "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    if "properties" in schema:
        yield schema
    for form in (*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("allOf", ())):
        yield from _forms(form, document)


_BOUNDS = (("minimum", "≥ "), ("exclusiveMinimum", "> "), ("maximum", "≤ "), ("exclusiveMaximum", "< "))


def _limits(schema: Mapping[str, Any], document: Mapping[str, Any]) -> str:
    found = []
    for form in (schema, *schema.get("anyOf", ())):
        if "enum" in form:
            found.append(" | ".join(map(str, form["enum"])))
        if "const" in form:
            found.append(str(form["const"]))
        told = [f"{sign}{form[key]:g}" for key, sign in _BOUNDS if key in form]
        if told:
            found.append(" and ".join(told))
        elif "type" in form and form["type"] not in ("object", "null"):
            found.append("" if "enum" in form or "const" in form else form["type"])
    if "default" in schema and not isinstance(schema["default"], (dict, list)):
        found.append("default " + json.dumps(schema["default"]))
    return ", ".join(part for part in found if part)
