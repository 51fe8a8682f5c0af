"""Requests of rows that differ in a few numbers only, as those of a sweep do.

Reading a row takes as long for the fields that it shares with its neighbours as for those that vary. From two rows
whose texts differ in numbers only, a template is made: where these numbers are in a row, in the request and in its
JSON. A row that fits the template has only its numbers read and validated; every other row is read in full.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, RootModel, TypeAdapter
from pydantic_core import from_json, to_json

from app.designs.references import Path, replaced
from app.designs.schema import Strict
from app.store.batch_inputs import Row, Source, UnreadableRow

_NUMBER = rb"-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?"
_NUMBERS = re.compile(rb"(?<![\w.+-])(" + _NUMBER + rb")(?![\w.+-])")
_MARK = 20240229.4375
"""A number that no request contains, and the first of those put in the place of numbers that vary."""
_MOST_VARIED = 4
"""More of them would take longer one by one than the whole request."""
_MOST_ATTEMPTS = 6
"""Rows that do not resemble each other only take the time of these attempts."""

Read = tuple[BaseModel, bytes]
"""A request, and its JSON without the name."""


class Alike:
    """Reads rows by a template of those read before; ``encoded`` serializes a request without its name."""

    def __init__(self, source: Source, encoded: Callable[[BaseModel], bytes]) -> None:
        self._source, self._encoded = source, encoded
        self._first: tuple[Row, Read, list[bytes]] | None = None
        self._varied: set[int] = set()
        self._template: _Template | None = None
        self._attempts = _MOST_ATTEMPTS

    def read(self, row: Row) -> Read | None:
        """The valid request of a row that fits the template, the same as if read in full; None for any other row."""
        return None if self._template is None or row.unfit is not None else self._template.read(row.content)

    def learn(self, row: Row, read: Read) -> None:
        """Adapt the template to a row that was read in full, so that it fits the first such row and this one."""
        if self._attempts == 0:
            return
        self._attempts -= 1
        pieces = _NUMBERS.split(row.content)
        if self._first is None:
            self._first = row, read, pieces
            return
        first, (request, _), others = self._first
        differing = {k for k, (own, other) in enumerate(zip(pieces, others, strict=False)) if own != other}
        if len(pieces) != len(others) or not all(k % 2 for k in differing):
            self._first = row, read, pieces
            self._varied = set()
            return
        self._varied |= differing
        if 0 < len(self._varied) <= _MOST_VARIED:
            found = _template(self._source, first, others, request, sorted(self._varied), self._encoded)
            # Both rows have been read in full: a template that reads either of them otherwise is none.
            if found is not None and found.read(row.content) == read:
                self._template = found


class _Hole(NamedTuple):
    """A number that varies: its place in the request, and the validator of that field."""

    path: Path
    validated: Callable[[Any], Any]


class _Template(NamedTuple):
    """``row`` matches a row, with a group for each hole; ``json`` has a place for each, in the given ``order``."""

    request: BaseModel
    row: re.Pattern[bytes]
    holes: Sequence[_Hole]
    json: bytes
    order: Sequence[int]

    def read(self, content: bytes) -> Read | None:
        """The request of a row; None if it does not fit, or is not valid."""
        if (match := self.row.fullmatch(content)) is None:
            return None
        request, texts = self.request, []
        try:
            for hole, text in zip(self.holes, match.groups(), strict=True):
                value = hole.validated(from_json(text, allow_inf_nan=False))
                request = replaced(request, hole.path, value)
                texts.append(to_json(value))
        except ValueError:
            return None
        if request.contradictions():  # type: ignore[attr-defined]
            return None
        return request, self.json % tuple([texts[k] for k in self.order])


def _template(
    source: Source, row: Row, pieces: Sequence[bytes], request: BaseModel, varied: Sequence[int],
    encoded: Callable[[BaseModel], bytes],
) -> _Template | None:  # fmt: skip
    """The template of a row whose ``varied`` pieces are the numbers that vary; None if one of them is no number of the
    request, but part of a text."""
    marks = [_MARK + 1000.0 * k for k in range(len(varied))]
    marked = list(pieces)
    for k, mark in zip(varied, marks, strict=True):
        marked[k] = to_json(mark)
    try:
        places = dict(_numbers(source.body(row._replace(content=b"".join(marked)))))
    except UnreadableRow:
        return None
    paths = [[path for path, number in places.items() if number == mark] for mark in marks]
    if any(len(found) != 1 for found in paths):
        return None
    holes, shown = [], request
    for [path], mark in zip(paths, marks, strict=True):
        validated = _validator(request, path)
        if validated is None:
            return None
        holes.append(_Hole(path, validated))
        shown = replaced(shown, path, mark)
    json, texts = encoded(shown), [to_json(mark) for mark in marks]
    if any(json.count(text) != 1 for text in texts):
        return None
    order = sorted(range(len(texts)), key=lambda k: json.index(texts[k]))
    json = re.sub(b"|".join(map(re.escape, texts)), b"%b", json.replace(b"%", b"%%"))
    pattern = [b"(" + _NUMBER + b")" if k in varied else re.escape(piece) for k, piece in enumerate(pieces)]
    return _Template(request, re.compile(b"".join(pattern)), holes, json, order)


def _numbers(value: Any, path: Path = ()) -> Iterator[tuple[Path, float]]:
    """The numbers of a JSON object in objects of any depth, with their paths."""
    for name, inner in value.items():
        if isinstance(inner, Mapping):
            yield from _numbers(inner, (*path, name))
        elif isinstance(inner, float):
            yield (*path, name), inner


def _validator(request: BaseModel, path: Path) -> Callable[[Any], Any] | None:
    """What validates the field of a request at a path; None if the path leads elsewhere."""
    here: Any = request.root if isinstance(request, RootModel) else request
    for step in path[:-1]:
        here = getattr(here, str(step), None)
    return _of_field(type(here), str(path[-1])) if isinstance(here, Strict) else None


@cache
def _of_field(model: type[BaseModel], name: str) -> Callable[[Any], Any] | None:
    field = model.model_fields.get(name)
    if field is None:
        return None
    return TypeAdapter(Annotated[field.annotation, field], config=Strict.model_config).validator.validate_python
