"""Suggestions for misspelt names."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, RootModel, Tag

from app.designs.schema import is_tag

_MAX_LENGTH = 100
"""Longer input matches no name."""


def nearest(given: str, names: Iterable[str]) -> str | None:
    """The most similar name in any case, if one is similar; the same name with a unit suffix, or without what it is
    part of, comes first."""
    known, given = list(names), given[:_MAX_LENGTH].lower()
    with_unit = [name for name in known if name.startswith(f"{given}_") or given.endswith(f".{name.lower()}")]
    lower = {name.lower(): name for name in known}
    found = with_unit or [lower[name] for name in difflib.get_close_matches(given, lower, 1)]
    return found[0] if found else None


def fields_at(model: Any, location: Sequence[int | str]) -> tuple[str, ...]:
    """The field names of the object at a location given as in pydantic's errors."""
    here = list(_models(model, None))
    for part in location:
        if is_tag(part):
            here = [(tag, each) for tag, each in here if tag == part] or here
        elif isinstance(part, str):
            fields = [each.model_fields[part].annotation for _, each in here if part in each.model_fields]
            here = [found for annotation in fields for found in _models(annotation, None)]
    return tuple(dict.fromkeys(name for _, each in here for name in each.model_fields))


def _models(annotation: Any, tag: str | None) -> Iterator[tuple[str | None, type[BaseModel]]]:
    """The models in an annotation, each with its tag in the innermost union."""
    if isinstance(annotation, type) and issubclass(annotation, RootModel):
        yield from _models(annotation.model_fields["root"].annotation, tag)
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield tag, annotation
    elif get_origin(annotation) is Annotated:
        inner, *metadata = get_args(annotation)
        tags = [each.tag for each in metadata if isinstance(each, Tag)]
        yield from _models(inner, tags[0] if tags else tag)
    else:
        for inner in get_args(annotation):
            yield from _models(inner, tag)
