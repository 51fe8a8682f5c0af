"""Table definitions. ``migrations/`` creates them; a test compares the two."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    DateTime,
    Dialect,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    TypeDecorator,
    UniqueConstraint,
    text,
)

NAMING = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


class UtcDateTime(TypeDecorator[datetime]):
    """A timezone-aware time, stored in UTC to the microsecond on databases with and without time zones."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError("a stored time needs a time zone")
        in_utc = value.astimezone(UTC)
        return in_utc.replace(tzinfo=None) if dialect.name == "sqlite" else in_utc

    def process_result_value(self, value: Any, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


def _partial_index(column: str, *columns: str) -> Index:
    not_null = text(f"{column} IS NOT NULL")
    # Migrations create the indexes. postgresql_where would import that dialect even for SQLite.
    return Index(None, *(columns or (column, "id")), sqlite_where=not_null)


metadata = MetaData(naming_convention=NAMING)

# JSON parts are binary, so that the bytes that were returned are stored exactly on every database.
runs = Table(
    "runs",
    metadata,
    Column("id", String(36), primary_key=True),
    Column("kind", String(64), nullable=False),
    Column("mode", String(16), nullable=False),
    Column("status", String(16), nullable=False),
    Column("name", String(200)),
    Column("created_at", UtcDateTime(), nullable=False),
    Column("spec", LargeBinary, nullable=False),
    Column("spec_hash", String(64), nullable=False),
    Column("result", LargeBinary),
    Column("problem", LargeBinary),
    Column("effects", LargeBinary, nullable=False),
    Column("accuracy", LargeBinary),
    Column("timing", LargeBinary, nullable=False),
    Column("solver_name", String(64), nullable=False),
    Column("solver_version", String(64), nullable=False),
    Column("cached", Boolean, nullable=False),
    Column("batch_id", String(36)),
    Column("source_run_ids", LargeBinary),
    Column("row_hash", String(64), nullable=False),
    Column("verdict", LargeBinary),
    Column("holds", Boolean),
    Column("figure_name", String(64)),
    Column("figure", Float),
    Column("owner", String(36)),
    # Every filter of a listing scans its index in id order, newest first.
    Index(None, "kind", "id"),
    Index(None, "mode", "id"),
    Index(None, "status", "id"),
    # partial indexes, without the runs that have no such value
    _partial_index("name"),
    _partial_index("batch_id"),
    _partial_index("holds"),
    _partial_index("figure"),
    _partial_index("owner"),
    Index(None, "created_at"),
    Index(None, "spec_hash"),
)

idempotency_keys = Table(
    "idempotency_keys",
    metadata,
    Column("key", String(255), primary_key=True),
    Column("request_hash", String(64), nullable=False),
    Column("run_id", String(36), ForeignKey("runs.id"), nullable=False),
    Column("status_code", Integer, nullable=False),
    Column("location", String(500)),
    Column("content_type", String(100), nullable=False),
    Column("body", LargeBinary, nullable=False),
    Column("row_hash", String(64), nullable=False),
    Index(None, "run_id"),
)

# Leases of runs accepted with 202 and not ended yet: the process working on each, and the expiry.
promises = Table(
    "promises",
    metadata,
    Column("run_id", String(36), ForeignKey("runs.id"), primary_key=True),
    Column("owner", String(64), nullable=False),
    Column("leased_until", Float, nullable=False),
    Column("attempts", Integer, nullable=False),
)

api_keys = Table(
    "api_keys",
    metadata,
    Column("id", String(16), primary_key=True),
    Column("digest", String(64), nullable=False),
    Column("name", String(200), nullable=False),
    Column("scopes", String(100), nullable=False),
    Column("created_at", UtcDateTime(), nullable=False),
    Column("revoked_at", UtcDateTime()),
    Column("row_hash", String(64), nullable=False),
    UniqueConstraint("digest"),
)

audit = Table(
    "audit",
    metadata,
    Column("id", String(36), primary_key=True),
    Column("at", UtcDateTime(), nullable=False),
    Column("actor", String(200), nullable=False),
    Column("action", String(64), nullable=False),
    Column("subject", String(200), nullable=False),
    Column("row_hash", String(64), nullable=False),
)

# One row: the number of runs inserted, counted by a trigger, and a counter that readiness probes write.
ledger = Table(
    "ledger",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("runs", BigInteger, nullable=False),
    Column("probe", BigInteger, nullable=False),
)

batches = Table(
    "batches",
    metadata,
    Column("number", Integer, primary_key=True),
    Column("id", String(36), nullable=False),
    Column("kind", String(64), nullable=False),
    Column("mode", String(16), nullable=False),
    Column("name", String(200)),
    Column("detail", String(16), nullable=False),
    Column("status", String(16), nullable=False),
    Column("source", LargeBinary, nullable=False),
    Column("dictionary", LargeBinary, nullable=False),
    Column("solver_name", String(64), nullable=False),
    Column("solver_version", String(64), nullable=False),
    Column("total", Integer, nullable=False),
    Column("succeeded", Integer, nullable=False),
    Column("infeasible", Integer, nullable=False),
    Column("failed", Integer, nullable=False),
    Column("refused", Integer, nullable=False),
    Column("created_at", UtcDateTime(), nullable=False),
    Column("started_at", UtcDateTime()),
    Column("ended_at", UtcDateTime()),
    Column("received_until", Float),
    Column("idempotency_key", String(255)),
    Column("request_hash", String(64)),
    Column("answer", LargeBinary),
    Column("owner", String(36)),
    UniqueConstraint("id"),
    UniqueConstraint("idempotency_key"),
    Index(None, "status", "number"),
)

# Input: compressed blocks of items, in the order received.
batch_blocks = Table(
    "batch_blocks",
    metadata,
    Column("batch", Integer, ForeignKey("batches.number"), primary_key=True),
    Column("first", Integer, primary_key=True),
    Column("count", Integer, nullable=False),
    Column("content", LargeBinary, nullable=False),
    Column("digest", LargeBinary, nullable=False),
)

# Work: ranges of items within one block, each waiting, leased, done or cancelled.
batch_chunks = Table(
    "batch_chunks",
    metadata,
    Column("batch", Integer, ForeignKey("batches.number"), primary_key=True),
    Column("first", Integer, primary_key=True),
    Column("count", Integer, nullable=False),
    Column("block", Integer, nullable=False),
    Column("state", String(16), nullable=False),
    Column("attempts", Integer, nullable=False),
    Column("owner", String(64)),
    Column("leased_until", Float),
    Index(None, "batch", "state", "first"),
)

# Output: one row per ended item, compressed with the batch's dictionary. ``asked`` is part of the hash of the request,
# kept only where equal items are looked up; a match is confirmed by comparing the specs.
batch_items = Table(
    "batch_items",
    metadata,
    Column("batch", Integer, ForeignKey("batches.number"), primary_key=True),
    Column("index", Integer, primary_key=True),
    Column("line", Integer),
    Column("status", String(16), nullable=False),
    Column("holds", Boolean),
    Column("figure", Float),
    Column("content", LargeBinary, nullable=False),
    Column("digest", LargeBinary, nullable=False),
    Column("asked", BigInteger),
    Index(None, "batch", "status", "index"),
    _partial_index("asked", "batch", "asked"),
    sqlite_with_rowid=False,
)

JSON_COLUMNS = ("spec", "result", "problem", "effects", "accuracy", "timing", "source_run_ids", "verdict")
