"""Migrations from nothing, twice, at once from several processes' threads; the tables agree with the models."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from sqlalchemy import inspect

from app.store.engine import make_engine
from app.store.migrate import current_revision, head_revision, newest_step, schema_differences, upgrade
from app.store.models import metadata


def test_from_nothing_to_the_models_and_again(empty_database_url: str) -> None:
    upgrade(empty_database_url)
    assert schema_differences(empty_database_url) == []
    upgrade(empty_database_url)
    engine = make_engine(empty_database_url)
    with engine.connect() as connection:
        assert current_revision(connection) == head_revision()
        assert set(inspect(connection).get_table_names()) == {*metadata.tables, "alembic_version"}
    engine.dispose()


def test_a_difference_would_be_seen(database_url: str) -> None:
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.exec_driver_sql("DROP INDEX ix_runs_spec_hash")
    engine.dispose()
    assert any("ix_runs_spec_hash" in str(difference) for difference in schema_differences(database_url))


def test_the_newest_file_is_the_newest_step() -> None:
    assert newest_step() == head_revision()


def test_several_may_migrate_at_once(empty_database_url: str) -> None:
    with ThreadPoolExecutor(4) as threads:
        for done in [threads.submit(upgrade, empty_database_url) for _ in range(4)]:
            done.result()
    assert schema_differences(empty_database_url) == []
