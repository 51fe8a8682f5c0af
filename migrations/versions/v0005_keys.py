"""API keys, owners, the audit log, and a ledger of the number of runs.

A trigger counts every inserted run, so that missing ones are detected. The downgrade drops owners; the row hash of a
run with an owner then correctly reports the loss.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

_SQLITE = """
CREATE TRIGGER count_runs AFTER INSERT ON runs BEGIN
    UPDATE ledger SET runs = runs + 1;
END
"""
_POSTGRESQL = (
    """
CREATE FUNCTION count_runs() RETURNS trigger AS $$
BEGIN
    UPDATE ledger SET runs = runs + (SELECT count(*) FROM added);
    RETURN NULL;
END $$ LANGUAGE plpgsql
""",
    """
CREATE TRIGGER count_runs AFTER INSERT ON runs REFERENCING NEW TABLE AS added
FOR EACH STATEMENT EXECUTE FUNCTION count_runs()
""",
)


def upgrade() -> None:
    op.create_table(
        "api_keys",
        sa.Column("id", sa.String(16), nullable=False),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("scopes", sa.String(100), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("revoked_at", sa.DateTime(timezone=True)),
        sa.Column("row_hash", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_api_keys"),
        sa.UniqueConstraint("digest", name="uq_api_keys_digest"),
    )
    op.create_table(
        "audit",
        sa.Column("id", sa.String(36), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("actor", sa.String(200), nullable=False),
        sa.Column("action", sa.String(64), nullable=False),
        sa.Column("subject", sa.String(200), nullable=False),
        sa.Column("row_hash", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_audit"),
    )
    op.add_column("runs", sa.Column("owner", sa.String(36)))
    op.add_column("batches", sa.Column("owner", sa.String(36)))
    owned = sa.text("owner IS NOT NULL")
    op.create_index("ix_runs_owner_id", "runs", ["owner", "id"], sqlite_where=owned, postgresql_where=owned)
    ledger = op.create_table(
        "ledger",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("runs", sa.BigInteger, nullable=False),
        sa.Column("probe", sa.BigInteger, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_ledger"),
    )
    connection = op.get_bind()
    there = connection.execute(sa.text("SELECT count(*) FROM runs")).scalar_one()
    connection.execute(sa.insert(ledger).values(id=1, runs=there, probe=0))
    for statement in (_SQLITE,) if connection.dialect.name == "sqlite" else _POSTGRESQL:
        op.execute(statement)


def downgrade() -> None:
    if op.get_bind().dialect.name == "sqlite":
        op.execute("DROP TRIGGER count_runs")
    else:
        op.execute("DROP TRIGGER count_runs ON runs")
        op.execute("DROP FUNCTION count_runs")
    op.drop_table("ledger")
    op.drop_index("ix_runs_owner_id", table_name="runs")
    op.drop_column("batches", "owner")
    op.drop_column("runs", "owner")
    op.drop_table("audit")
    op.drop_table("api_keys")
