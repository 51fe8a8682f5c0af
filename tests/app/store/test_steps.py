"""Migrations of a populated database killed at each statement: atomic in every case."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from sqlalchemy import Engine, event, func, select, text

from app.store.engine import make_engine
from app.store.migrate import upgrade
from app.store.models import ledger, promises, runs
from app.store.operations import INSERT_RUN
from app.store.rows import run_to_row
from app.store.verify import verify
from tests.app.store.records import make_record
from tests.app.store.revisions import head_revision
from tests.app.store.test_migrate import stepped

CAMPAIGN = bool(os.environ.get("CRANKWRIGHT_CAMPAIGN"))
ROWS, EVERY = (10_000, 1) if CAMPAIGN else (300, 9)
"""Number of runs, and the statements at which a migration is killed."""
OPEN = 7


def filled(url: str) -> None:
    """Runs as stored by the first version, some of them open."""
    plain = {"verdict": None, "holds": None, "figure_name": None, "figure": None}
    records = [make_record(float(k), **plain, **({"status": "queued"} if k < OPEN else {})) for k in range(ROWS)]
    engine = make_engine(url)
    with engine.begin() as connection:
        INSERT_RUN(connection, *map(run_to_row, records))
    engine.dispose()


def killed(step: Callable[[], None], statement: int) -> bool:
    """Run a migration in a process killed before its n-th statement; False if it had finished."""
    child = os.fork()
    if not child:
        try:
            left = iter(range(statement))

            @event.listens_for(Engine, "before_cursor_execute")
            def _count(*_: Any) -> None:
                if next(left, None) is None:
                    os.kill(os.getpid(), signal.SIGKILL)

            step()
            os._exit(0)
        finally:
            os._exit(1)
    status = os.waitpid(child, 0)[1]
    assert os.WIFSIGNALED(status) or os.waitstatus_to_exitcode(status) == 0
    return os.WIFSIGNALED(status)


def revision_and_rows(url: str) -> tuple[str, int]:
    engine = make_engine(url)
    with engine.connect() as connection:
        revision = connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one()
        found = revision, connection.execute(select(func.count()).select_from(runs)).scalar_one()
    engine.dispose()
    return found


@pytest.mark.skipif(sys.platform == "win32", reason="there is no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.timeout(3600 if CAMPAIGN else 180)
def test_migrations_are_atomic(empty_database_url: str) -> None:
    url = empty_database_url
    upgrade(url)
    filled(url)
    kills = 0
    for step, before, behind in (
        (partial(stepped, url, "0001"), head_revision(), "0001"),
        (partial(upgrade, url), "0001", head_revision()),
    ):
        statement = 1
        while killed(step, statement):
            assert revision_and_rows(url) == (before, ROWS)
            statement += EVERY
            kills += 1
        assert revision_and_rows(url) == (behind, ROWS)
    print(f"{kills} kills in steps on {ROWS} runs")
    assert kills >= 6
    assert verify(url).sound
    engine = make_engine(url)
    with engine.connect() as connection:
        assert connection.execute(select(ledger.c.runs)).scalar_one() == ROWS
        # Existing open runs can be taken over by any process.
        held = connection.execute(select(promises.c.owner, promises.c.leased_until)).all()
        assert [tuple(row) for row in held] == [("", 0.0)] * OPEN
    engine.dispose()
