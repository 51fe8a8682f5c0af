"""The verdict on a run, and whether it holds, for which runs are looked up.

Both are null of runs made before, of analyses and of what has no answer. Going down drops them: a run that has a
verdict then no longer agrees with its row hash, which says rightly that something of it is lost.
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
