"""Migrations: from an empty database, repeated, and concurrent; the result agrees with the models."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from alembic import command
from alembic.config import Config
from sqlalchemy import inspect

from app.store.backup import backup
from app.store.engine import make_engine
from app.store.migrate import latest_revision, upgrade
from app.store.models import metadata
from app.store.record import RunFilter
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.store.records import make_record
from tests.app.store.revisions import INI, current_revision, head_revision, schema_differences


def test_an_empty_database_is_migrated_to_the_models(empty_database_url: str) -> None:
    upgrade(empty_database_url)
    assert schema_differences(empty_database_url) == []
    upgrade(empty_database_url)
    engine = make_engine(empty_database_url)
    with engine.connect() as connection:
        assert current_revision(connection) == head_revision()
        assert set(inspect(connection).get_table_names()) == {*metadata.tables, "alembic_version"}
    engine.dispose()


def test_schema_differences_are_detected(database_url: str) -> None:
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.exec_driver_sql("DROP INDEX ix_runs_spec_hash")
    engine.dispose()
    assert any("ix_runs_spec_hash" in str(difference) for difference in schema_differences(database_url))


def test_the_latest_revision_by_file_name_matches_alembic() -> None:
    assert latest_revision() == head_revision()


def test_concurrent_migrations(empty_database_url: str) -> None:
    with ThreadPoolExecutor(4) as threads:
        for done in [threads.submit(upgrade, empty_database_url) for _ in range(4)]:
            done.result()
    assert schema_differences(empty_database_url) == []


def stepped(url: str, revision: str) -> None:
    """Migrate to a revision with the Alembic command."""
    engine = make_engine(url)
    with engine.connect() as connection, connection.begin():
        config = Config(INI)
        config.attributes["connection"] = connection
        current = current_revision(connection)
        (command.upgrade if current is None or revision > current else command.downgrade)(config, revision)
    engine.dispose()


def test_a_store_of_an_earlier_version_is_copied_but_is_not_damaged(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'runs.sqlite3'}"
    stepped(url, "0004")
    for report in (verify(url), backup(url, tmp_path / "copy.sqlite3")):
        assert report.older == "0004" and report.sound
    upgrade(f"sqlite:///{tmp_path / 'copy.sqlite3'}")
    assert verify(f"sqlite:///{tmp_path / 'copy.sqlite3'}").older is None


def test_a_run_from_before_verdicts_stays_intact_without_one(empty_database_url: str) -> None:
    old = make_record(verdict=None, holds=None, figure_name=None, figure=None)
    new = make_record(verdict=b'{"holds":false}', holds=False)

    async def kept(*records):
        with RunStore(empty_database_url) as store:
            for record in records:
                await store.put(record)
            return await store.get(old.id), [run.id for run in (await store.list_runs(RunFilter(holds=False))).items]

    upgrade(empty_database_url)
    asyncio.run(kept(old))
    stepped(empty_database_url, "0001")
    engine = make_engine(empty_database_url)
    assert "verdict" not in {column["name"] for column in inspect(engine).get_columns("runs")}
    engine.dispose()
    upgrade(empty_database_url)
    assert asyncio.run(kept(new)) == (old, [new.id])
    assert verify(empty_database_url).sound
    # Down loses verdicts, which the hashes of their rows say; up again is the newest schema.
    stepped(empty_database_url, "0001")
    upgrade(empty_database_url)
    assert schema_differences(empty_database_url) == []
    assert [damage.key for damage in verify(empty_database_url).damages] == [new.id]
    assert asyncio.run(kept()) == (old, [])
