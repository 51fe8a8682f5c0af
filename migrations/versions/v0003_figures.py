"""The headline number of a run, for sorting listings: a design's objective, a part's mass.

Null for existing runs and runs without one. The downgrade drops it; the row hash then correctly reports the loss.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("runs", sa.Column("figure_name", sa.String(64)))
    op.add_column("runs", sa.Column("figure", sa.Float))
    given = sa.text("figure IS NOT NULL")
    op.create_index("ix_runs_figure_id", "runs", ["figure", "id"], sqlite_where=given, postgresql_where=given)


def downgrade() -> None:
    op.drop_index("ix_runs_figure_id", table_name="runs")
    op.drop_column("runs", "figure")
    op.drop_column("runs", "figure_name")
