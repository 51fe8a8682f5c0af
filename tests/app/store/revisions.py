"""Revisions of a database according to Alembic."""

from __future__ import annotations

from pathlib import Path

from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection

from app.store.engine import make_engine
from app.store.models import metadata

INI = str(Path(__file__).parents[3] / "alembic.ini")


def head_revision() -> str | None:
    """The latest revision."""
    return ScriptDirectory.from_config(Config(INI)).get_current_head()


def current_revision(connection: Connection) -> str | None:
    """The revision of a database; None if it is empty."""
    return MigrationContext.configure(connection).get_current_revision()


def schema_differences(url: str) -> list[object]:
    """Differences between a migrated database and the tables in ``models``; empty if they agree."""
    engine = make_engine(url)
    try:
        with engine.connect() as connection:
            return list(compare_metadata(MigrationContext.configure(connection), metadata))
    finally:
        engine.dispose()
