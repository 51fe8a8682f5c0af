"""Between records and rows: the only place that knows which column holds what."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from sqlalchemy import RowMapping

from app.store.hashing import canonical_json, row_hash
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
    values = {name: row[name] for name in RUN_FIELDS}
    sources = values["source_run_ids"]
    values["source_run_ids"] = tuple(json.loads(sources)) if sources else ()
    return RunRecord(**values)


def row_to_summary(row: RowMapping) -> RunSummary:
    return RunSummary(**{name: row[name] for name in SUMMARY_FIELDS})


def response_to_row(response: StoredResponse) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(response, name) for name in RESPONSE_FIELDS}
    row["row_hash"] = row_hash(idempotency_keys.name, row)
    return row


def row_to_response(row: RowMapping) -> StoredResponse:
    return StoredResponse(**{name: row[name] for name in RESPONSE_FIELDS})


def is_intact(table: str, row: RowMapping) -> bool:
    """Whether the row still says what was written."""
    return row["row_hash"] == row_hash(table, row)
