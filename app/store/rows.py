"""Conversion between records and database rows."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from sqlalchemy import RowMapping

from app.store.errors import DamagedRecord
from app.store.hashing import canonical_json, row_hash
from app.store.models import idempotency_keys, runs
from app.store.record import RunRecord, RunSummary, StoredResponse
from app.store.response_codec import pack, unpack

RUN_FIELDS = tuple(field.name for field in fields(RunRecord))
SUMMARY_FIELDS = tuple(field.name for field in fields(RunSummary))
RESPONSE_FIELDS = tuple(field.name for field in fields(StoredResponse))


def run_to_row(record: RunRecord) -> dict[str, Any]:
    values = vars(record)
    row: dict[str, Any] = {name: values[name] for name in RUN_FIELDS}
    row["source_run_ids"] = canonical_json(list(record.source_run_ids)) if record.source_run_ids else None
    row["row_hash"] = row_hash(runs.name, row)
    return row


def row_to_run(row: RowMapping) -> RunRecord:
    """The run in a row. Raises DamagedRecord if the row does not match its hash."""
    check(runs.name, "id", row)
    values = {name: row[name] for name in RUN_FIELDS}
    sources = values["source_run_ids"]
    values["source_run_ids"] = tuple(json.loads(sources)) if sources else ()
    return RunRecord(**values)


def row_to_summary(row: RowMapping) -> RunSummary:
    """The listing entry of a complete row. Raises DamagedRecord."""
    check(runs.name, "id", row)
    return RunSummary(**{name: row[name] for name in SUMMARY_FIELDS})


def response_to_row(response: StoredResponse, run: RunRecord) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(response, name) for name in RESPONSE_FIELDS}
    row["body"] = pack(response.body, run)
    row["row_hash"] = row_hash(idempotency_keys.name, row)
    return row


def row_to_response(row: RowMapping, run: RunRecord) -> StoredResponse:
    """The stored response of a row, with the parts taken from its run. Raises DamagedRecord."""
    check(idempotency_keys.name, "key", row)
    values = {name: row[name] for name in RESPONSE_FIELDS}
    try:
        values["body"] = unpack(row["body"], run)
    except ValueError as error:
        raise DamagedRecord(idempotency_keys.name, row["key"]) from error
    return StoredResponse(**values)


def check(table: str, key: str, row: RowMapping) -> None:
    """Raise DamagedRecord unless the row matches its hash."""
    if not is_intact(table, row):
        raise DamagedRecord(table, str(row[key]))


def is_intact(table: str, row: RowMapping) -> bool:
    """Whether the row matches its hash."""
    try:
        return row["row_hash"] == row_hash(table, row)
    except (TypeError, ValueError):  # a column of a type that is never written
        return False
