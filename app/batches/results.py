"""Streamed result table of a batch as NDJSON, CSV or Parquet."""

from __future__ import annotations

import asyncio
import csv
import io
import json
import sys
from collections.abc import AsyncIterator, Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from app.batches.columns import OWN, OWN_TYPES, Column, column, requested
from app.batches.fields import result_columns, wider
from app.designs.problems import DAMAGED as DAMAGED_TITLE
from app.designs.problems import NOT_SHOWN, problem_details
from app.designs.units import figures
from app.store.batch_inputs import Source
from app.store.batch_items import unpacked
from app.store.batch_reads import items_after, items_spread
from app.store.batch_records import DAMAGED, BatchRecord, Item, ItemStatus, item_id
from app.store.repository import RunStore

_PAGE = 500
_SAMPLE_SIZE = 2000
_PARQUET_ROWS = 20_000
_INT64 = 2**63
_SHORT_ARRAY = 16
"""Length up to which the entries of an array that varies are columns of their own; of a longer one its JSON text is."""
HEAD = ("index", "line", "run_id", "status", "holds")
_LAST = ("accuracy.estimated", "accuracy.met", "diagnosis", "problem")
_OF_HEAD, [_GOVERNED_BY], _OF_END = (
    [Column(name, OWN, name, OWN_TYPES[name]) for name in names] for names in (HEAD, ("governed_by",), _LAST)
)
MOST_POINTS = 4000
_POINT_FIELDS = ("index", "run_id", "status", "holds", "governed_by")
_FORMULA_PREFIXES = ("=", "+", "-", "@", "\t", "\r")


class Format(StrEnum):
    NDJSON = "ndjson"
    CSV = "csv"
    PARQUET = "parquet"


MEDIA_TYPES = {
    Format.NDJSON: "application/x-ndjson",
    Format.CSV: "text/csv; charset=utf-8",
    Format.PARQUET: "application/vnd.apache.parquet",
}


@dataclass(frozen=True)
class Wanted:
    """Selection of items by status and of fields by dotted name; empty selects all."""

    statuses: tuple[str, ...] = ()
    fields: tuple[str, ...] = ()


def flat(value: Any, prefix: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    """The scalars of a JSON value with their dotted names; arrays are omitted."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from flat(inner, f"{prefix}.{name}" if prefix else name, depth + 1)
    elif not isinstance(value, list):
        yield prefix, value


def _entries(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """The scalars of a JSON value with their dotted names, those in short arrays too, and the longer arrays."""
    if isinstance(value, Mapping):
        inner: Iterable[tuple[Any, Any]] = value.items()
    elif isinstance(value, list) and len(value) <= _SHORT_ARRAY:
        inner = enumerate(value)
    else:
        yield name, value
        return
    for step, entry in inner:
        yield from _entries(entry, f"{name}.{step}" if name else str(step))


def parts_of(batch: BatchRecord, item: Item) -> dict[str, Any]:
    """The parts of an item by name, with those of every item: identity, verdict, accuracy, why there is no result."""
    parts = _stored_parts(batch, item)
    verdict, accuracy = parts.get("verdict") or {}, parts.get("accuracy") or {}
    own = {
        "index": item.index,
        "line": item.line,
        "run_id": item_id(batch.id, item.index),
        "status": item.status,
        "holds": item.holds,
        "governed_by": verdict.get("governed_by"),
        "accuracy": accuracy,
        "diagnosis": _diagnosis(parts.get("result")),
        "problem": _problem(parts.get("problem")),
    }
    return {**parts, OWN: own}


def _stored_parts(batch: BatchRecord, item: Item) -> dict[str, Any]:
    """The stored parts of an item by name; of a damaged one only why it is not shown."""
    if item.status == DAMAGED:
        return {"problem": problem_details(DAMAGED_TITLE, 500, NOT_SHOWN)}
    return unpacked(item.content, batch.dictionary)


def row_of(columns: Sequence[Column], parts: Mapping[str, Any]) -> dict[str, Any]:
    """A row of the given columns."""
    return {each.name: each.value(parts) for each in columns}


def whole_row_of(varied: Sequence[Column], parts: Mapping[str, Any]) -> dict[str, Any]:
    """A row of what every item has, the varied fields and all scalars of the result."""
    row = row_of((*_OF_HEAD, *varied, _GOVERNED_BY), parts)
    row |= {name: value for name, value in flat(parts.get("result") or {}) if name not in row}
    return row | row_of(_OF_END, parts)


def _diagnosis(result: Any) -> str | None:
    """A one-line summary of why no design meets the requirements, in the units of their names."""
    found = result.get("diagnosis") if isinstance(result, dict) else None
    if not found:
        return None
    return "; ".join(
        f"{item['requirement']}: required {figures(item['required'])}, attainable "
        f"{'nothing' if item['attainable'] is None else figures(item['attainable'])}: {item['advice']}"
        for item in found
    )


def _problem(problem: Any) -> str | None:
    """A one-line summary of a problem."""
    if not isinstance(problem, dict):
        return None
    errors = [f"{e['pointer'] or '/'} {e['detail']} (allowed: {e['allowed']})" for e in problem.get("errors", ())]
    return f"{problem['title']}: " + ("; ".join(errors) or problem["detail"])


async def rows(store: RunStore, batch: BatchRecord, wanted: Wanted) -> AsyncIterator[list[dict[str, Any]]]:
    """The rows of finished items in item order, a page at a time; a damaged item has a row that says so."""
    chosen = _chosen(batch, wanted)
    varied = () if chosen else await varied_of(store, batch)
    after = -1
    while True:

        def page(connection: Any, after: int = after) -> tuple[list[dict[str, Any]], int]:
            items = items_after(connection, batch.number, after, _PAGE, wanted.statuses)
            found = (parts_of(batch, item) for item in items)
            made = [row_of(chosen, parts) if chosen else whole_row_of(varied, parts) for parts in found]
            return made, items[-1].index if items else -1

        found, last = await store.query(page)
        if not found:
            return
        yield found
        after = last


def _chosen(batch: BatchRecord, wanted: Wanted) -> list[Column]:
    """The columns asked for; none if all are."""
    found = (column(batch.kind, batch.mode, name) for name in wanted.fields)
    return [each for each in found if each is not None]


async def varied_of(store: RunStore, batch: BatchRecord) -> tuple[Column, ...]:
    """The columns of the fields in which the requests differ."""
    return tuple(requested(batch.kind, batch.mode, field) for field in await _varied_fields(store, batch))


async def _varied_fields(store: RunStore, batch: BatchRecord) -> tuple[str, ...]:
    """The fields in which the requests differ: as declared by the source, else found in the first items."""
    source = Source.from_json(batch.source)
    if source.form != "ndjson":
        return source.varied

    def look(connection: Any) -> tuple[str, ...]:
        first: dict[str, Any] | None = None
        found: dict[str, None] = {}
        for item in items_after(connection, batch.number, -1, _SAMPLE_SIZE):
            spec = _stored_parts(batch, item).get("spec")
            if not isinstance(spec, dict) or item.status == ItemStatus.REFUSED:
                continue
            fields = dict(_entries(spec))
            first = fields if first is None else first
            found |= {name: None for name in {**first, **fields} if first.get(name) != fields.get(name)}
        return tuple(found)

    return await store.query(look)


async def points(store: RunStore, batch: BatchRecord, wanted: Wanted) -> dict[str, Any]:
    """An evenly spaced sample of finished items, at most ``MOST_POINTS``, for the explorer.

    Each point has index, run, status, verdict and the requested fields. Also returns the numeric fields of the first
    succeeded item, the varied ones separately; the columns of a table all count as varied, but those whose values are
    all alike come last.
    """
    step = max(1, -(-batch.total // MOST_POINTS))
    varied, chosen = await varied_of(store, batch), _chosen(batch, wanted)

    def look(connection: Any) -> dict[str, Any]:
        found: list[list[Any]] = []
        names: dict[str, None] = {}
        values: dict[str, set[Any]] = {each.name: set() for each in varied}
        for item in items_spread(connection, batch.number, step, MOST_POINTS):
            parts = parts_of(batch, item)
            row = whole_row_of(varied, parts)
            for name, known in values.items():
                if len(known) < 2:
                    known.add(row[name])
            if item.status == ItemStatus.SUCCEEDED and not names:
                names = {name: None for name, value in row.items() if _is_number(value) and name not in HEAD}
            row |= row_of(chosen, parts)
            found.append([*(row[name] for name in _POINT_FIELDS), *(row.get(name) for name in wanted.fields)])
        given = [name for name in values if name in names]
        first = [name for name in given if len(values[name]) > 1] or given
        rest = [name for name in names if name not in given] + [name for name in given if name not in first]
        return {"fields": [*_POINT_FIELDS, *wanted.fields], "points": found, "varied": first, "results": rest}

    return await store.query(look)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


async def unanswered(store: RunStore, batch: BatchRecord, most: int) -> list[dict[str, Any]]:
    """The first items without an answer, at most ``most``: line or number, run, status, diagnosis and problem."""
    statuses = (ItemStatus.INFEASIBLE, ItemStatus.REFUSED, ItemStatus.FAILED)

    def look(connection: Any) -> list[dict[str, Any]]:
        found = []
        for item in items_after(connection, batch.number, -1, most, statuses):
            parts = _stored_parts(batch, item)
            found.append(
                {
                    "line": item.line or item.index + 1,
                    "run_id": item_id(batch.id, item.index),
                    "status": item.status,
                    "diagnosis": (parts.get("result") or {}).get("diagnosis") or [],
                    "problem": parts.get("problem"),
                }
            )
        return found

    return await store.query(look)


async def streamed(store: RunStore, batch: BatchRecord, wanted: Wanted, form: Format) -> AsyncIterator[bytes]:
    """The result table in the given format."""
    write: Callable[..., AsyncIterator[bytes]] = {
        Format.NDJSON: _ndjson,
        Format.CSV: _csv,
        Format.PARQUET: _parquet,
    }[form]
    async for part in write(store, batch, wanted):
        yield part


async def _ndjson(store: RunStore, batch: BatchRecord, wanted: Wanted) -> AsyncIterator[bytes]:
    async for page in rows(store, batch, wanted):
        lines = (json.dumps(row, ensure_ascii=False, separators=(",", ":"), allow_nan=False) for row in page)
        yield await asyncio.to_thread(lambda lines=lines: ("\n".join(lines) + "\n").encode("utf-8", "replace"))


async def columns_of(store: RunStore, batch: BatchRecord, wanted: Wanted) -> dict[str, type]:
    """The columns of the table and their types.

    Columns found in a sample of items come first, in their order, then all others that the result schema allows: no
    value is lost, and no second pass over the items is needed. Types are those of the schemas, not of the sample, for
    a refused row may have anything anywhere.
    """
    if chosen := _chosen(batch, wanted):
        return {each.name: each.type for each in chosen}
    known = result_columns(batch.kind, batch.mode)
    step = max(1, batch.total // _SAMPLE_SIZE)
    varied = await varied_of(store, batch)

    def look(connection: Any) -> dict[str, type]:
        found: dict[str, type] = dict.fromkeys(whole_row_of(varied, {}), type(None))
        for item in items_spread(connection, batch.number, step, 2 * _SAMPLE_SIZE):
            for name, value in whole_row_of(varied, parts_of(batch, item)).items():
                found[name] = wider(found.get(name, type(None)), type(value))
        return found

    found = {**await store.query(look), **known}
    found |= {each.name: each.type for each in (*_OF_HEAD, *varied, _GOVERNED_BY)}
    return {**{name: kind for name, kind in found.items() if name not in _LAST}, **{n: OWN_TYPES[n] for n in _LAST}}


def _safe(value: Any) -> Any:
    """Escape text that a spreadsheet would evaluate as a formula; numbers are unchanged."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str) and value.startswith(_FORMULA_PREFIXES):
        return "'" + value
    return value


async def _csv(store: RunStore, batch: BatchRecord, wanted: Wanted) -> AsyncIterator[bytes]:
    names = list(await columns_of(store, batch, wanted))
    yield _csv_lines([names])
    async for page in rows(store, batch, wanted):
        yield await asyncio.to_thread(_csv_lines, ([_safe(row.get(name)) for name in names] for row in page))


def _csv_lines(records: Iterable[Sequence[Any]]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\r\n").writerows(records)
    return text.getvalue().encode("utf-8", "replace")


async def _parquet(store: RunStore, batch: BatchRecord, wanted: Wanted) -> AsyncIterator[bytes]:
    import pyarrow
    import pyarrow.parquet

    types = {int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_()}
    columns = await columns_of(store, batch, wanted)
    schema = pyarrow.schema([(name, types.get(kind, pyarrow.string())) for name, kind in columns.items()])
    sink = _DrainableSink()
    waiting: list[dict[str, Any]] = []
    with pyarrow.parquet.ParquetWriter(pyarrow.PythonFile(sink, mode="w"), schema) as writer:

        def write() -> None:
            made = [{n: _converted(row.get(n), kind) for n, kind in columns.items()} for row in waiting]
            writer.write_table(pyarrow.Table.from_pylist(made, schema=schema))
            waiting.clear()

        async for page in rows(store, batch, wanted):
            waiting += page
            if len(waiting) >= _PARQUET_ROWS:
                await asyncio.to_thread(write)
                yield sink.drain()
        await asyncio.to_thread(write)
    yield sink.drain()


def _converted(value: Any, kind: type) -> Any:
    """The value as its column's type; None for one of another type, which only a refused row has."""
    if value is None or (isinstance(value, kind) and kind is not int):
        return value
    if kind is bool:
        return None
    if kind is not int and kind is not float:
        return str(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    if kind is int:
        return value if isinstance(value, int) and abs(value) < _INT64 else None
    return float(value) if abs(value) <= sys.float_info.max else None


class _DrainableSink(io.RawIOBase):
    """A write-only file whose buffered content can be drained."""

    def __init__(self) -> None:
        super().__init__()
        self._parts: list[bytes] = []
        self._at = 0

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        self._parts.append(bytes(data))
        self._at += len(self._parts[-1])
        return len(self._parts[-1])

    def tell(self) -> int:
        return self._at

    def drain(self) -> bytes:
        found = b"".join(self._parts)
        self._parts.clear()
        return found
