"""The tables. ``migrations/`` builds them; a test compares the two."""

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
    """An aware time, kept in UTC to the microsecond on databases with and without time zones."""

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


def _index_where_given(given: str, *columns: str) -> Index:
    # Migrations make the indexes. postgresql_where would import that dialect wherever runs are kept.
    return Index(None, *columns, sqlite_where=text(f"{given} IS NOT NULL"))


metadata = MetaData(naming_convention=NAMING)

# JSON parts are binary: what was answered is what is kept, byte for byte, on every database.
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
    # Every filter of the listing walks its index in the order of the ids, newest first.
    Index(None, "kind", "id"),
    Index(None, "mode", "id"),
    Index(None, "status", "id"),
    # Runs without a name, a batch or a verdict stay out of these.
    _index_where_given("name", "name", "id"),
    _index_where_given("batch_id", "batch_id", "id"),
    _index_where_given("holds", "holds", "id"),
    _index_where_given("figure", "figure", "id"),
    _index_where_given("owner", "owner", "id"),
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

# A run that was promised by a 202, until it ends: which process works on it, and until when that holds.
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

# One row: how many runs there must be, counted by a trigger, and what readiness writes to see whether it can.
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

# What was sent, in the order it was sent: blocks of items, compressed.
batch_blocks = Table(
    "batch_blocks",
    metadata,
    Column("batch", Integer, ForeignKey("batches.number"), primary_key=True),
    Column("first", Integer, primary_key=True),
    Column("count", Integer, nullable=False),
    Column("content", LargeBinary, nullable=False),
    Column("digest", LargeBinary, nullable=False),
)

# What is to be done: ranges of items within one block, each waiting, leased, done or cancelled.
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

# What came out: one row per ended item, its parts compressed together with the batch's dictionary. ``asked`` is a part
# of the hash of what was asked, kept only where equal items are looked for; whoever finds one compares the specs.
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
    _index_where_given("asked", "batch", "asked"),
    sqlite_with_rowid=False,
)

JSON_COLUMNS = ("spec", "result", "problem", "effects", "accuracy", "timing", "source_run_ids", "verdict")
