"""Bring a database to the schema of this version, from any earlier one or from nothing.

One that is there already needs no migrations, and so none of their machinery, which takes long to import.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, Engine, text
from sqlalchemy.exc import DBAPIError

import migrations
from app.store.engine import WRITE, make_engine
from app.store.errors import StoreError
from app.store.faults import Trouble, fault_of, told

if TYPE_CHECKING:
    from alembic.config import Config

MIGRATION_LOCK = 7_265_110_421
"""PostgreSQL's advisory lock that lets only one process migrate at a time (SQLite's write lock does the same)."""

_STEPS = Path(migrations.__file__).parent / "versions"


def upgrade(url: str) -> None:
    """Run every step the database has not seen, all in one transaction; safe to run from several processes at once."""
    engine = make_engine(url, patient=True)
    try:
        with told():
            _upgrade(engine)
    finally:
        engine.dispose()


class NewerDatabase(StoreError):
    """The database was used by a later version."""

    def __init__(self, revision: str) -> None:
        super().__init__(f"the database is at revision {revision}, this version knows those up to {newest_step()}")


def _upgrade(engine: Engine) -> None:
    found = _revision(engine)
    if found == newest_step():
        return
    if found is not None and found > newest_step():
        raise NewerDatabase(found)
    from alembic import command

    with engine.connect().execution_options(**WRITE) as connection, connection.begin():
        if engine.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": MIGRATION_LOCK})
        config = _config()
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def _revision(engine: Engine) -> str | None:
    try:
        with engine.connect() as connection:
            return connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    except DBAPIError as error:
        fault = fault_of(error)
        if fault is not None and fault.trouble is not Trouble.GONE:
            raise
        return None  # an empty database


def newest_step() -> str:
    """The newest step by the names of the files, which are v0001_… and so on in their order."""
    return max(match[1] for path in _STEPS.iterdir() if (match := re.match(r"v(\d+)_.*\.py$", path.name)))


def head_revision() -> str:
    """The newest step this version knows."""
    from alembic.script import ScriptDirectory

    revision = ScriptDirectory.from_config(_config()).get_current_head()
    assert revision is not None
    return revision


def current_revision(connection: Connection) -> str | None:
    """The step the database is at; None for an empty one."""
    from alembic.migration import MigrationContext

    return MigrationContext.configure(connection).get_current_revision()


def schema_differences(url: str) -> list[object]:
    """What separates the migrated database from the tables in ``models``; empty when they agree."""
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    from app.store.models import metadata

    engine = make_engine(url)
    try:
        with engine.connect() as connection:
            return list(compare_metadata(MigrationContext.configure(connection), metadata))
    finally:
        engine.dispose()


def _config() -> Config:
    from alembic.config import Config

    config = Config()
    # % would start an interpolation in the configuration file's syntax.
    config.set_main_option("script_location", str(Path(migrations.__file__).parent).replace("%", "%%"))
    return config
