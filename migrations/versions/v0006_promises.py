"""Leases of runs accepted with 202: the process working on each, and the expiry.

Runs that are open at the migration have expired leases, so that the next process takes them over.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "promises",
        sa.Column("run_id", sa.String(36), nullable=False),
        sa.Column("owner", sa.String(64), nullable=False),
        sa.Column("leased_until", sa.Float, nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.PrimaryKeyConstraint("run_id", name="pk_promises"),
        sa.ForeignKeyConstraint(["run_id"], ["runs.id"], name="fk_promises_run_id_runs"),
    )
    op.execute(
        "INSERT INTO promises (run_id, owner, leased_until, attempts) "
        "SELECT id, '', 0, 0 FROM runs WHERE status IN ('queued', 'running')"
    )


def downgrade() -> None:
    op.drop_table("promises")
