"""Migrate a database, empty or from any earlier version, to this version's schema.

An up-to-date database is detected without importing Alembic, which is slow.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Engine, text
from sqlalchemy.exc import DBAPIError

import migrations
from app.store.engine import WRITE, make_engine
from app.store.errors import StoreError
from app.store.faults import FaultKind, fault_of, raising_faults

if TYPE_CHECKING:
    from alembic.config import Config

MIGRATION_LOCK = 7_265_110_421
"""PostgreSQL advisory lock that serialises migrations (SQLite's write lock does the same)."""

_STEPS = Path(migrations.__file__).parent / "versions"


def upgrade(url: str) -> None:
    """Apply all pending migrations in one transaction; safe to call from several processes at once.

    Raises NewerDatabase, StoreFault.
    """
    engine = make_engine(url, long_running=True)
    try:
        with raising_faults():
            _upgrade(engine)
    finally:
        engine.dispose()


class NewerDatabase(StoreError):
    """The database was migrated by a later version."""

    def __init__(self, revision: str) -> None:
        super().__init__(f"the database is at revision {revision}, this version supports up to {latest_revision()}")


def _upgrade(engine: Engine) -> None:
    found = revision(engine)
    if found == latest_revision():
        return
    if found is not None and found > latest_revision():
        raise NewerDatabase(found)
    from alembic import command

    with engine.connect().execution_options(**WRITE) as connection, connection.begin():
        if engine.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": MIGRATION_LOCK})
        config = _config()
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def revision(engine: Engine) -> str | None:
    """The revision of the database; None if it is empty."""
    try:
        with engine.connect() as connection:
            return connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    except DBAPIError as error:
        fault = fault_of(error)
        if fault is not None and fault.kind is not FaultKind.GONE:
            raise
        return None  # an empty database


def latest_revision() -> str:
    """The latest revision by file names, which are v0001_… and so on."""
    return max(match[1] for path in _STEPS.iterdir() if (match := re.match(r"v(\d+)_.*\.py$", path.name)))


def _config() -> Config:
    from alembic.config import Config

    config = Config()
    # % starts an interpolation in Alembic's configuration.
    config.set_main_option("script_location", str(Path(migrations.__file__).parent).replace("%", "%%"))
    return config
