"""A column that identifies equal items of batches, filled where solving an item again would take long."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

_INDEX = "ix_batch_items_batch_asked"


def upgrade() -> None:
    op.add_column("batch_items", sa.Column("asked", sa.BigInteger))
    given = sa.text("asked IS NOT NULL")
    op.create_index(_INDEX, "batch_items", ["batch", "asked"], sqlite_where=given, postgresql_where=given)


def downgrade() -> None:
    op.drop_index(_INDEX, "batch_items")
    # Not by Alembic's batch mode: it copies an SQLite table to drop a column, and the copy would have row ids.
    op.execute("ALTER TABLE batch_items DROP COLUMN asked")
