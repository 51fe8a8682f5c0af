"""Generate the Python client's types from the API models: `python scripts/client_types.py`.

Every schema of the OpenAPI document becomes a TypedDict, an alias or a Literal. A test checks that the file is up to
date.
"""

from __future__ import annotations

import json
import keyword
import textwrap
from pathlib import Path
from typing import Any

from app.api.contract import document
from app.main import create_app

FILE = Path(__file__).parents[1] / "clients/python/crankwright_client/types.py"
_HEAD = '''"""Requests and answers, as the service describes them. Made by scripts/client_types.py: not to be edited."""

from __future__ import annotations

from typing import Any, Literal, Union

from typing_extensions import NotRequired, TypedDict
'''
_PLAIN = {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "null": "None"}


def types() -> str:
    """The file."""
    schemas = document(create_app())["components"]["schemas"]
    return "\n\n".join([_HEAD.rstrip(), *(_declared(name, schemas[name]) for name in sorted(schemas))]) + "\n"


def _declared(name: str, schema: dict[str, Any]) -> str:
    if schema.get("type") != "object" or "properties" not in schema:
        return f"{name} = {_type(schema, quoted=True)}"
    required = set(schema.get("required", ()))
    if any(keyword.iskeyword(field) for field in schema["properties"]):
        return _called(name, schema, required)
    lines = [f"class {name}(TypedDict):"]
    if words := schema.get("description"):
        lines += [*_docstring(words), ""]
    for field, part in schema["properties"].items():
        kind = _type(part)
        lines.append(f"    {field}: {kind if field in required else f'NotRequired[{kind}]'}")
        if words := part.get("description"):
            lines += _docstring(words)
    return "\n" + "\n".join(lines)


def _called(name: str, schema: dict[str, Any], required: set[str]) -> str:
    """A TypedDict in functional syntax, for field names that are not Python identifiers."""
    lines = [f"{name} = TypedDict(", f'    "{name}",', "    {"]
    for field, part in schema["properties"].items():
        kind = _type(part, quoted=True)
        lines.append(f'        "{field}": {kind if field in required else f"NotRequired[{kind}]"},')
    return "\n".join([*lines, "    },", ")"])


def _docstring(words: str) -> list[str]:
    text = textwrap.fill(" ".join(words.split()).replace('"""', "'''"), 110)
    return textwrap.indent(f'"""{text}"""', "    ").splitlines()


def _type(schema: dict[str, Any], quoted: bool = False) -> str:
    """The type of a schema; ``quoted`` for forward references."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f'"{name}"' if quoted else name
    if "const" in schema:
        return f"Literal[{json.dumps(schema['const'])}]"
    if "enum" in schema:
        return f"Literal[{', '.join(map(json.dumps, schema['enum']))}]"
    several = schema.get("anyOf") or schema.get("oneOf")
    if several:
        parts = list(dict.fromkeys(_type(part, quoted) for part in several))
        if len(parts) == 1:
            return parts[0]
        return f"Union[{', '.join(parts)}]" if quoted else " | ".join(parts)
    kind = schema.get("type")
    if kind == "array":
        items = schema.get("items")
        return f"list[{_type(items, quoted)}]" if isinstance(items, dict) else "list[Any]"
    if kind == "object":
        values = schema.get("additionalProperties")
        return f"dict[str, {_type(values, quoted) if isinstance(values, dict) else 'Any'}]"
    return _PLAIN.get(kind, "Any")


if __name__ == "__main__":
    FILE.write_text(types(), encoding="utf-8")
