"""Alembic environment: runs migrations on the connection provided by ``app.store.migrate``.

The ``alembic`` command has no such connection and opens one with CRANKWRIGHT_DATABASE_URL or the URL in alembic.ini.
"""

from __future__ import annotations

import os

from alembic import context
from sqlalchemy import Connection

from app.store.engine import WRITE, make_engine
from app.store.models import metadata


def _run(connection: Connection) -> None:
    # Both databases have transactional DDL: a failed migration leaves nothing behind.
    context.configure(
        connection=connection,
        target_metadata=metadata,
        render_as_batch=True,
        transactional_ddl=True,
        compare_type=True,
    )
    context.run_migrations()


connection_given = context.config.attributes.get("connection")
if connection_given is not None:
    _run(connection_given)
else:
    url = os.environ.get("CRANKWRIGHT_DATABASE_URL") or context.config.get_main_option("sqlalchemy.url")
    if not url:
        raise SystemExit("set CRANKWRIGHT_DATABASE_URL or sqlalchemy.url in alembic.ini")
    engine = make_engine(url)
    with engine.connect().execution_options(**WRITE) as own, own.begin():
        _run(own)
    engine.dispose()
