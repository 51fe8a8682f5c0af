"""Between records and rows: the only place that knows which column holds what."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from sqlalchemy import RowMapping

from app.store.errors import DamagedRecord
from app.store.hashing import canonical_json, row_hash
from app.store.kept_answers import packed, unpacked
from app.store.models import idempotency_keys, runs
from app.store.record import RunRecord, RunSummary, StoredResponse

RUN_FIELDS = tuple(field.name for field in fields(RunRecord))
SUMMARY_FIELDS = tuple(field.name for field in fields(RunSummary))
RESPONSE_FIELDS = tuple(field.name for field in fields(StoredResponse))


def run_to_row(record: RunRecord) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(record, name) for name in RUN_FIELDS}
    row["source_run_ids"] = canonical_json(list(record.source_run_ids)) if record.source_run_ids else None
    row["row_hash"] = row_hash(runs.name, row)
    return row


def row_to_run(row: RowMapping) -> RunRecord:
    """The run of a row. Raises DamagedRecord where the row does not say what was written."""
    check(runs.name, "id", row)
    values = {name: row[name] for name in RUN_FIELDS}
    sources = values["source_run_ids"]
    values["source_run_ids"] = tuple(json.loads(sources)) if sources else ()
    return RunRecord(**values)


def row_to_summary(row: RowMapping) -> RunSummary:
    """The line of a whole row. Raises DamagedRecord."""
    check(runs.name, "id", row)
    return RunSummary(**{name: row[name] for name in SUMMARY_FIELDS})


def response_to_row(response: StoredResponse, run: RunRecord) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(response, name) for name in RESPONSE_FIELDS}
    row["body"] = packed(response.body, run)
    row["row_hash"] = row_hash(idempotency_keys.name, row)
    return row


def row_to_response(row: RowMapping, run: RunRecord) -> StoredResponse:
    """The answer kept in a row, with the parts that its run has. Raises DamagedRecord."""
    check(idempotency_keys.name, "key", row)
    values = {name: row[name] for name in RESPONSE_FIELDS}
    try:
        values["body"] = unpacked(row["body"], run)
    except ValueError as error:
        raise DamagedRecord(idempotency_keys.name, row["key"]) from error
    return StoredResponse(**values)


def check(table: str, key: str, row: RowMapping) -> None:
    """Raises DamagedRecord where a row does not say what was written."""
    try:
        intact = is_intact(table, row)
    except (TypeError, ValueError):  # a value of a type that no row is written with
        intact = False
    if not intact:
        raise DamagedRecord(table, str(row[key]))


def is_intact(table: str, row: RowMapping) -> bool:
    """Whether the row still says what was written."""
    return row["row_hash"] == row_hash(table, row)
