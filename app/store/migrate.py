"""Bring a database to the schema of this version, from any earlier one or from nothing."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, text

import migrations
from app.store.engine import WRITE, make_engine
from app.store.models import metadata

MIGRATION_LOCK = 7_265_110_421
"""PostgreSQL's advisory lock that lets only one process migrate at a time (SQLite's write lock does the same)."""


def upgrade(url: str) -> None:
    """Run every step the database has not seen, all in one transaction; safe to run from several processes at once."""
    engine = make_engine(url)
    try:
        with engine.connect().execution_options(**WRITE) as connection, connection.begin():
            if engine.dialect.name == "postgresql":
                connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": MIGRATION_LOCK})
            config = _config()
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
    finally:
        engine.dispose()


def head_revision() -> str:
    """The newest step this version knows."""
    revision = ScriptDirectory.from_config(_config()).get_current_head()
    assert revision is not None
    return revision


def current_revision(connection: Connection) -> str | None:
    """The step the database is at; None for an empty one."""
    return MigrationContext.configure(connection).get_current_revision()


def schema_differences(url: str) -> list[object]:
    """What separates the migrated database from the tables in ``models``; empty when they agree."""
    engine = make_engine(url)
    try:
        with engine.connect() as connection:
            return list(compare_metadata(MigrationContext.configure(connection), metadata))
    finally:
        engine.dispose()


def _config() -> Config:
    config = Config()
    # % would start an interpolation in the configuration file's syntax.
    config.set_main_option("script_location", str(Path(migrations.__file__).parent).replace("%", "%%"))
    return config
