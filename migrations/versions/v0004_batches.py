"""Batches: input blocks, chunks of work, and one row per item.

The downgrade drops all batches with their items.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "batches",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(64), nullable=False),
        sa.Column("mode", sa.String(16), nullable=False),
        sa.Column("name", sa.String(200)),
        sa.Column("detail", sa.String(16), nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("source", sa.LargeBinary, nullable=False),
        sa.Column("dictionary", sa.LargeBinary, nullable=False),
        sa.Column("solver_name", sa.String(64), nullable=False),
        sa.Column("solver_version", sa.String(64), nullable=False),
        sa.Column("total", sa.Integer, nullable=False),
        sa.Column("succeeded", sa.Integer, nullable=False),
        sa.Column("infeasible", sa.Integer, nullable=False),
        sa.Column("failed", sa.Integer, nullable=False),
        sa.Column("refused", sa.Integer, nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True)),
        sa.Column("ended_at", sa.DateTime(timezone=True)),
        sa.Column("received_until", sa.Float),
        sa.Column("idempotency_key", sa.String(255)),
        sa.Column("request_hash", sa.String(64)),
        sa.Column("answer", sa.LargeBinary),
        sa.PrimaryKeyConstraint("number", name="pk_batches"),
        sa.UniqueConstraint("id", name="uq_batches_id"),
        sa.UniqueConstraint("idempotency_key", name="uq_batches_idempotency_key"),
    )
    op.create_index("ix_batches_status_number", "batches", ["status", "number"])
    op.create_table(
        "batch_blocks",
        sa.Column("batch", sa.Integer, nullable=False),
        sa.Column("first", sa.Integer, nullable=False),
        sa.Column("count", sa.Integer, nullable=False),
        sa.Column("content", sa.LargeBinary, nullable=False),
        sa.Column("digest", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("batch", "first", name="pk_batch_blocks"),
        sa.ForeignKeyConstraint(["batch"], ["batches.number"], name="fk_batch_blocks_batch_batches"),
    )
    op.create_table(
        "batch_chunks",
        sa.Column("batch", sa.Integer, nullable=False),
        sa.Column("first", sa.Integer, nullable=False),
        sa.Column("count", sa.Integer, nullable=False),
        sa.Column("block", sa.Integer, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.Column("owner", sa.String(64)),
        sa.Column("leased_until", sa.Float),
        sa.PrimaryKeyConstraint("batch", "first", name="pk_batch_chunks"),
        sa.ForeignKeyConstraint(["batch"], ["batches.number"], name="fk_batch_chunks_batch_batches"),
    )
    op.create_index("ix_batch_chunks_batch_state_first", "batch_chunks", ["batch", "state", "first"])
    op.create_table(
        "batch_items",
        sa.Column("batch", sa.Integer, nullable=False),
        sa.Column("index", sa.Integer, nullable=False),
        sa.Column("line", sa.Integer),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("holds", sa.Boolean),
        sa.Column("figure", sa.Float),
        sa.Column("content", sa.LargeBinary, nullable=False),
        sa.Column("digest", sa.LargeBinary, nullable=False),
        sa.PrimaryKeyConstraint("batch", "index", name="pk_batch_items"),
        sa.ForeignKeyConstraint(["batch"], ["batches.number"], name="fk_batch_items_batch_batches"),
        sqlite_with_rowid=False,
    )
    op.create_index("ix_batch_items_batch_status_index", "batch_items", ["batch", "status", "index"])


def downgrade() -> None:
    for table in ("batch_items", "batch_chunks", "batch_blocks", "batches"):
        op.drop_table(table)
