"""Names that appear more than once in a JSON object: a parser keeps the last value, the sender may mean the first."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


class _Repeating(dict[str, Any]):
    """A JSON object with repeated names, each listed once."""

    names: tuple[str, ...]


def as_object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The ``object_pairs_hook`` of a decoder whose result is to be searched by ``repeated``."""
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    repeating, seen = _Repeating(found), set()
    repeating.names = tuple(dict.fromkeys(name for name, _ in pairs if name in seen or seen.add(name)))
    return repeating


def repeated(value: Any, path: tuple[int | str, ...] = ()) -> Iterator[tuple[int | str, ...]]:
    """The paths of all repeated names in a decoded value."""
    if isinstance(value, _Repeating):
        yield from ((*path, name) for name in value.names)
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, child in children:
        yield from repeated(child, (*path, name))
