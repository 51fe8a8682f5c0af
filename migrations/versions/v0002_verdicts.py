"""Verdicts of runs, and an indexed column for whether they hold.

Both are null for existing runs, analyses and runs without a result. The downgrade drops them; the row hash of a run
with a verdict then no longer matches, which correctly reports the loss.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("runs", sa.Column("verdict", sa.LargeBinary))
    op.add_column("runs", sa.Column("holds", sa.Boolean))
    judged = sa.text("holds IS NOT NULL")
    op.create_index("ix_runs_holds_id", "runs", ["holds", "id"], sqlite_where=judged, postgresql_where=judged)


def downgrade() -> None:
    op.drop_index("ix_runs_holds_id", table_name="runs")
    op.drop_column("runs", "holds")
    op.drop_column("runs", "verdict")
