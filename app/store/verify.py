"""Verify a store: row hashes, JSON parts, schema, file.

SQLite's own integrity check misses a flipped bit inside a row; the row hash detects it. A trigger counts inserted runs,
so deletions by anything other than `prune` are detected too.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import Connection, Engine, RowMapping, Table, func, inspect, select, text
from sqlalchemy.exc import DBAPIError

from app.store.batch_verify import batch_damages
from app.store.damage import Damage
from app.store.engine import check_exists, make_engine
from app.store.hashing import spec_hash
from app.store.migrate import latest_revision, revision
from app.store.models import (
    JSON_COLUMNS,
    api_keys,
    audit,
    batch_blocks,
    batch_chunks,
    batch_items,
    batches,
    idempotency_keys,
    ledger,
    promises,
    runs,
)
from app.store.rows import is_intact

PAGE = 500
_TABLES = (runs, idempotency_keys, api_keys, audit)
_BATCHES = (batches, batch_blocks, batch_chunks, batch_items)


@dataclass(frozen=True)
class Report:
    """Number of rows read, and what is wrong with them."""

    runs: int = 0
    idempotency_keys: int = 0
    batch_items: int = 0
    damages: tuple[Damage, ...] = field(default=())
    older: str | None = None
    """The revision of a database of an earlier version, of which nothing was read."""

    @property
    def sound(self) -> bool:
        return not self.damages


def verify(url: str) -> Report:
    """Read the whole store once. Damage is reported, never raised, even if the database cannot be opened. Raises
    MissingDatabase."""
    check_exists(url)
    engine = make_engine(url, long_running=True)
    counts = dict.fromkeys((table.name for table in _TABLES), 0)
    damages: list[Damage] = []
    items = 0
    try:
        if (found := revision(engine)) is not None and found < latest_revision():
            return Report(older=found)
        with engine.connect() as connection:
            _tolerate_broken_text(connection)
            damages += _schema_damages(connection)
            broken = {damage.table for damage in damages}
            for table in _TABLES:
                if table.name in broken:
                    continue
                for row_or_damage in _rows(connection, table):
                    if isinstance(row_or_damage, Damage):
                        damages.append(row_or_damage)
                    else:
                        counts[table.name] += 1
                        damages += _row_damages(table, row_or_damage)
            if not broken & {runs.name, ledger.name}:
                damages += _missing(connection)
            if not broken & {table.name for table in _BATCHES}:
                for damage_or_count in batch_damages(connection):
                    if isinstance(damage_or_count, Damage):
                        damages.append(damage_or_count)
                    else:
                        items += damage_or_count
            damages += _file_damages(engine, connection)
    except DBAPIError as error:
        damages.append(Damage("", None, f"the database cannot be read: {error.orig}"))
    finally:
        engine.dispose()
    return Report(counts[runs.name], counts[idempotency_keys.name], items, tuple(damages))


def _tolerate_broken_text(connection: Connection) -> None:
    """Decode invalid UTF-8 to surrogates, so that such rows are hashed and reported."""
    if connection.dialect.name == "sqlite":
        driver = connection.connection.driver_connection
        assert driver is not None
        driver.text_factory = lambda content: content.decode("utf-8", "surrogateescape")


def _schema_damages(connection: Connection) -> Iterator[Damage]:
    inspector = inspect(connection)
    present = set(inspector.get_table_names())
    for table in (*_TABLES, ledger, promises, *_BATCHES):
        if table.name not in present:
            yield Damage(table.name, None, "the table is missing")
            continue
        columns = {column["name"] for column in inspector.get_columns(table.name)}
        for missing in sorted({column.name for column in table.columns} - columns):
            yield Damage(table.name, None, f"the column {missing} is missing")


def _rows(connection: Connection, table: Table) -> Iterator[RowMapping | Damage]:
    """All rows in pages by key; rows of an unreadable page are read one by one."""
    key = table.primary_key.columns[0]
    keys = list(connection.execute(select(key).order_by(key)).scalars())
    for first in range(0, len(keys), PAGE):
        page = keys[first : first + PAGE]
        try:
            query = select(table).where(key >= page[0], key <= page[-1]).order_by(key)
            yield from list(connection.execute(query).mappings())
        except (DBAPIError, ValueError, TypeError, AttributeError):
            yield from _rows_one_by_one(connection, table, page)


def _rows_one_by_one(connection: Connection, table: Table, keys: list[str]) -> Iterator[RowMapping | Damage]:
    key = table.primary_key.columns[0]
    for each in keys:
        try:
            yield connection.execute(select(table).where(key == each)).mappings().one()
        # An invalid timestamp fails in the column type's parser, with any exception.
        except Exception as error:
            yield Damage(table.name, _printable(each), f"the row cannot be read: {error}")


def _row_damages(table: Table, row: RowMapping) -> Iterator[Damage]:
    key = _printable(row[table.primary_key.columns[0].name])
    if not is_intact(table.name, row):
        yield Damage(table.name, key, "the content does not match its row hash")
    for name in JSON_COLUMNS:
        if name in table.columns and row[name] is not None and not _is_json(row[name]):
            yield Damage(table.name, key, f"{name} is not valid JSON")
    if table is runs and not _spec_hash_agrees(row):
        yield Damage(table.name, key, "the spec does not match its spec hash")


def _spec_hash_agrees(row: RowMapping) -> bool:
    try:
        return spec_hash(row["kind"], row["mode"], row["spec"]) == row["spec_hash"]
    except (TypeError, ValueError, RecursionError):  # invalid JSON or UTF-8
        return False


def _is_json(content: Any) -> bool:
    try:
        json.loads(bytes(content))
    except (ValueError, TypeError, RecursionError):
        return False
    return True


def _missing(connection: Connection) -> Iterator[Damage]:
    # In one statement, because a running service may insert runs meanwhile.
    present = select(func.count()).select_from(runs).scalar_subquery()
    lost = connection.execute(select(ledger.c.runs - present)).scalar()
    if lost is None:
        yield Damage(ledger.name, None, "the count of runs is missing")
    elif lost:
        what = f"{lost} runs are missing that were stored" if lost > 0 else f"{-lost} runs were never counted"
        yield Damage(runs.name, None, what)


def _file_damages(engine: Engine, connection: Connection) -> Iterator[Damage]:
    if engine.dialect.name != "sqlite":
        return
    for (line,) in connection.execute(text("PRAGMA integrity_check")):
        if line != "ok":
            yield Damage("", None, f"SQLite's integrity check: {line}")
    for table, rowid, parent, _ in connection.execute(text("PRAGMA foreign_key_check")):
        yield Damage(str(table), str(rowid), f"refers to a row of {parent} that does not exist")


def _printable(value: Any) -> str:
    return str(value).encode("utf-8", "backslashreplace").decode()
