"""Storage of batch rows as sent: packed into blocks, and parsed into request bodies.

A row is kept verbatim: a line of JSON, a CSV record or, for sweeps and Parquet, an array of cells. The worker
validates it.
"""

from __future__ import annotations

import csv
import io
import json
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

from pydantic_core import from_json, to_json

from app.repeated_names import as_object, repeated
from app.store.hashing import canonical_json

_LEVEL = 3
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_TABLE = "a table saved as CSV in UTF-8"


class Row(NamedTuple):
    """One row as sent: its line number, its bytes, and the reason if it was rejected on intake (``unfit``)."""

    line: int | None
    content: bytes
    unfit: str | None = None


class UnreadableRow(Exception):
    """A row that is not a request body of any kind, and what is ``allowed`` instead."""

    def __init__(self, reason: str, allowed: str = "one request of this kind") -> None:
        super().__init__(reason)
        self.allowed = allowed


class RepeatedNames(UnreadableRow):
    """A row of JSON with names that appear more than once in their object, at ``paths``."""

    def __init__(self, paths: Iterable[tuple[int | str, ...]]) -> None:
        super().__init__("has names that appear more than once in their object")
        self.paths = paths


@dataclass(frozen=True)
class Source:
    """How rows are parsed: ``form`` is ndjson, csv or cells; ``columns`` are dotted names; cells of ``texts`` are never
    parsed as numbers; ``base`` is the part common to all bodies; ``varied`` are the fields that differ; ``delimiter``
    separates the cells of a CSV; unless it is a comma, numbers may have decimal commas.

    An empty cell of a table is a field not given, the null of a sweep replaces what its base has.
    """

    form: str
    columns: tuple[str, ...] = ()
    texts: frozenset[str] = frozenset()
    base: Mapping[str, Any] = field(default_factory=dict)
    varied: tuple[str, ...] = ()
    delimiter: str = ","

    def to_json(self) -> bytes:
        return canonical_json({**vars(self), "texts": sorted(self.texts)})

    @classmethod
    def from_json(cls, text: bytes) -> Source:
        told = json.loads(text)
        lists = {"columns": tuple(told["columns"]), "varied": tuple(told["varied"]), "texts": frozenset(told["texts"])}
        return cls(**{**told, **lists})

    def body(self, row: Row) -> dict[str, Any]:
        """The request body of a row. Raises UnreadableRow."""
        if self.form == "csv":
            return _nested(self.base, self.columns, self._cells(row))
        if row.unfit is not None:
            raise UnreadableRow(row.unfit)
        if self.form == "ndjson":
            found = _json(row.content)
            if not isinstance(found, dict):
                raise UnreadableRow("is no JSON object")
            return found
        return _nested(self.base, self.columns, json.loads(row.content))

    def _cells(self, row: Row) -> list[Any]:
        texts = record(row, self.delimiter)
        width = len(self.columns)
        if len(texts) > width and not any(cell.strip() for cell in texts[width:]):
            texts = texts[:width]
        if len(texts) != width:
            raise UnreadableRow(f"has {len(texts)} cells where the header has {width}", "a cell for each column")
        return [self._cell(name, text) for name, text in zip(self.columns, texts, strict=True)]

    def _cell(self, name: str, text: str) -> Any:
        if text == "" or name in self.texts:
            return text or None
        if text in ("true", "false", "null") or text[0] in "-0123456789.,+[{" or text[:1].isspace():
            bare = text.strip()
            try:
                return _json(bare.removeprefix("+").encode())
            except UnreadableRow:
                # Tables come from many programs: 5., .5 and 05 are numbers there, although not in JSON.
                number = bare if self.delimiter == "," else bare.replace(",", ".", 1)
                return float(number) if _NUMBER.fullmatch(number) else text
        return text


def record(row: Row, delimiter: str) -> list[str]:
    """The cells of a row of a CSV. Raises UnreadableRow."""
    if row.unfit is not None:
        raise UnreadableRow(row.unfit, _TABLE)
    try:
        text = row.content.decode()
    except UnicodeDecodeError:
        raise UnreadableRow("is no UTF-8", _TABLE) from None
    try:
        records = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True))
    except csv.Error as error:
        raise UnreadableRow(f"cannot be read as CSV: {error}", _TABLE) from None
    if len(records) != 1:
        raise UnreadableRow("is not one record of CSV", _TABLE)
    return records[0]


def _json(content: bytes) -> Any:
    # pydantic's parser takes a third of the time, but ignores duplicate names. In a text without escapes these are
    # found by counting quotes: every string has two, and those of a duplicate name are missing when the result is
    # serialized again.
    if b"\\" not in content:
        try:
            found = from_json(content, allow_inf_nan=False)
            if content.count(b'"') == to_json(found).count(b'"'):
                return found
        except ValueError:
            pass
    try:
        found = _DECODER.decode(content.decode(json.detect_encoding(content), "surrogatepass"))
        if paths := list(repeated(found)):
            raise RepeatedNames(paths)
        return found
    except UnreadableRow:
        raise
    except RecursionError:
        raise UnreadableRow("is nested too deeply") from None
    except ValueError:
        raise UnreadableRow("is not well-formed JSON in UTF-8") from None


def _reject_constant(constant: str) -> Any:
    raise UnreadableRow(f"has {constant}, which is no JSON")


_DECODER = json.JSONDecoder(object_pairs_hook=as_object, parse_constant=_reject_constant)


def _nested(base: Mapping[str, Any], columns: Sequence[str], cells: Sequence[Any]) -> dict[str, Any]:
    """The base with each cell set at its dotted path, without a base the non-empty ones; a numeric step is an array
    index."""
    found = _copied(base)
    for name, value in zip(columns, cells, strict=True):
        if value is None and not base:
            continue
        here: Any = found
        steps = name.split(".")
        for step, following in pairwise(steps):
            here = _inner(here, step, {} if not following.isdigit() else [])
        _set(here, steps[-1], value)
    return found


def _copied(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _copied(inner) for name, inner in value.items()}
    return [_copied(inner) for inner in value] if isinstance(value, list) else value


def _inner(here: Any, step: str, empty: Any) -> Any:
    if isinstance(here, list):
        index = _index(step, here)
        if not isinstance(here[index], (dict, list)):
            here[index] = empty
        return here[index]
    if not isinstance(here.get(step), (dict, list)):
        here[step] = empty
    return here[step]


def _set(here: Any, step: str, value: Any) -> None:
    if isinstance(here, list):
        here[_index(step, here)] = value
    else:
        here[step] = value


_MAX_ARRAY_LENGTH = 10_000


def _index(step: str, array: list[Any]) -> int:
    if not step.isdigit() or int(step) >= _MAX_ARRAY_LENGTH:
        raise UnreadableRow(f"has a column that names {step[:20]!r} where an array has its index")
    array.extend([None] * (int(step) + 1 - len(array)))
    return int(step)


def packed_rows(rows: Sequence[Row]) -> bytes:
    """Block content, zlib-compressed: a JSON header line with line numbers, sizes and reasons, then the rows."""
    head = {
        "lines": [row.line for row in rows],
        "sizes": [len(row.content) for row in rows],
        "unfit": {str(k): row.unfit for k, row in enumerate(rows) if row.unfit is not None},
    }
    return zlib.compress(canonical_json(head) + b"\n" + b"".join(row.content for row in rows), _LEVEL)


def unpacked_rows(content: bytes, start: int = 0, end: int | None = None) -> list[Row]:
    """Rows [``start``, ``end``) of a block, relative to its first row."""
    head, whole = _opened(content)
    lines, sizes, unfit = head["lines"], head["sizes"], head["unfit"]
    at = sum(sizes[:start])
    rows = []
    for k in range(start, len(sizes) if end is None else min(end, len(sizes))):
        rows.append(Row(lines[k], whole[at : at + sizes[k]], unfit.get(str(k))))
        at += sizes[k]
    return rows


@lru_cache(maxsize=1)
def _opened(content: bytes) -> tuple[dict[str, Any], bytes]:
    """Header and rows of a block; the latest block is cached, since its chunks mostly follow each other."""
    head, _, whole = zlib.decompress(content).partition(b"\n")
    return json.loads(head), whole
