"""Runs, and responses stored under idempotency keys."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def _index_of_named(name: str, column: str) -> None:
    named = sa.text(f"{column} IS NOT NULL")
    op.create_index(name, "runs", [column, "id"], sqlite_where=named, postgresql_where=named)


def upgrade() -> None:
    op.create_table(
        "runs",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("kind", sa.String(64), nullable=False),
        sa.Column("mode", sa.String(16), nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("name", sa.String(200)),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("spec", sa.LargeBinary, nullable=False),
        sa.Column("spec_hash", sa.String(64), nullable=False),
        sa.Column("result", sa.LargeBinary),
        sa.Column("problem", sa.LargeBinary),
        sa.Column("effects", sa.LargeBinary, nullable=False),
        sa.Column("accuracy", sa.LargeBinary),
        sa.Column("timing", sa.LargeBinary, nullable=False),
        sa.Column("solver_name", sa.String(64), nullable=False),
        sa.Column("solver_version", sa.String(64), nullable=False),
        sa.Column("cached", sa.Boolean, nullable=False),
        sa.Column("batch_id", sa.String(36)),
        sa.Column("source_run_ids", sa.LargeBinary),
        sa.Column("row_hash", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_runs"),
    )
    op.create_index("ix_runs_kind_id", "runs", ["kind", "id"])
    op.create_index("ix_runs_mode_id", "runs", ["mode", "id"])
    op.create_index("ix_runs_status_id", "runs", ["status", "id"])
    _index_of_named("ix_runs_name_id", "name")
    _index_of_named("ix_runs_batch_id_id", "batch_id")
    op.create_index("ix_runs_created_at", "runs", ["created_at"])
    op.create_index("ix_runs_spec_hash", "runs", ["spec_hash"])
    op.create_table(
        "idempotency_keys",
        sa.Column("key", sa.String(255), nullable=False),
        sa.Column("request_hash", sa.String(64), nullable=False),
        sa.Column("run_id", sa.String(36), nullable=False),
        sa.Column("status_code", sa.Integer, nullable=False),
        sa.Column("location", sa.String(500)),
        sa.Column("content_type", sa.String(100), nullable=False),
        sa.Column("body", sa.LargeBinary, nullable=False),
        sa.Column("row_hash", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("key", name="pk_idempotency_keys"),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_idempotency_keys_run_id_runs"),
    )
    op.create_index("ix_idempotency_keys_run_id", "idempotency_keys", ["run_id"])


def downgrade() -> None:
    op.drop_table("idempotency_keys")
    op.drop_table("runs")
