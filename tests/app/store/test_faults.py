"""Database faults are reported within five seconds, show no wrong data, lose nothing, and recover."""

from __future__ import annotations

import asyncio
import os
import sqlite3
import time
from collections.abc import Callable, Coroutine, Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select, text

from app.store.engine import make_engine
from app.store.errors import DamagedRecord, UnknownRun
from app.store.faults import FaultKind, StoreFault
from app.store.keys import CreateKey, KeyRecord, list_keys, read_audit
from app.store.migrate import NewerDatabase, upgrade
from app.store.models import runs
from app.store.record import RunFilter, new_run_id, utc_now
from app.store.repository import RunStore
from tests.app.store.records import make_record, make_response
from tests.databases import sqlite_database

CAMPAIGN = bool(os.environ.get("CRANKWRIGHT_CAMPAIGN"))

WITHIN_S = 5.5
"""Five seconds, and half of one for a busy machine."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    sqlite_database(tmp_path)
    return tmp_path / "runs.sqlite3"


@pytest.fixture
def store(file: Path) -> Iterator[RunStore]:
    with RunStore(f"sqlite:///{file}") as opened:
        yield opened


def edit(file: Path, statement: str, *values: object) -> None:
    with sqlite3.connect(file) as connection:
        connection.execute(statement, values)
    connection.close()


async def fault_kind_of(work: Coroutine[Any, Any, Any]) -> FaultKind | None:
    began = time.monotonic()
    try:
        await work
    except StoreFault as fault:
        assert time.monotonic() - began < WITHIN_S
        return fault.kind
    return None


def check_reported(store: RunStore, kind: FaultKind | None) -> None:
    """Check that a write and the readiness probe report this fault."""

    async def both() -> list[FaultKind | None]:
        store._probed = -100.0
        return [await fault_kind_of(store.put(make_record())), await fault_kind_of(store.ping())]

    assert asyncio.run(both()) == [kind, kind]


# -- damage -----------------------------------------------------------------------------------------------------


def test_a_damaged_run_is_never_shown(store: RunStore, file: Path) -> None:
    good, bad = make_record(name="good"), make_record(name="bad")
    store.put_and_wait(good, make_response(good, "good"))
    store.put_and_wait(bad, make_response(bad, "bad"))
    edit(file, "UPDATE runs SET result = ? WHERE id = ?", b'{"fatigue_safety": 2.71}', bad.id)

    async def look() -> None:
        assert await store.get(good.id) == good
        for reading in (
            lambda: store.get(bad.id),
            lambda: store.find_response("bad", "a" * 64),
            lambda: store.finish(bad.id, None),
        ):
            with pytest.raises(DamagedRecord):
                await reading()
        page = await store.list_runs(RunFilter())
        assert [item.id for item in page.items] == [good.id] and page.damaged == (bad.id,)
        assert (await store.find_response("good", "a" * 64)).body == make_response(good).body
        await store.ping()

    asyncio.run(look())


def test_a_read_that_meets_damage_keeps_no_snapshot(store: RunStore, file: Path) -> None:
    """A statement that is not read to its end would let its connection show an old state to every later read."""
    for k in range(3):
        store.write_and_wait(CreateKey(KeyRecord(new_run_id(), f"{k}", "name", "solve", utc_now()), "test"))
    edit(file, "UPDATE api_keys SET name = 'another' WHERE id = (SELECT min(id) FROM api_keys)")
    edit(file, "UPDATE audit SET actor = 'another' WHERE id = (SELECT max(id) FROM audit)")
    kept = []
    for read in (list_keys, lambda connection: read_audit(connection, 3)):
        with pytest.raises(DamagedRecord) as caught:
            store.read(read)
        kept.append(caught)  # with its traceback and all that this refers to
    store.put_and_wait(make_record())
    count = select(func.count()).select_from(runs)
    assert [store.read(lambda connection: connection.execute(count).scalar_one()) for _ in range(4)] == [1] * 4


@pytest.mark.parametrize("value", [b"not a time", "2026-13-45", 7, None])
def test_an_invalid_timestamp_is_damage(store: RunStore, file: Path, value: object) -> None:
    run = make_record()
    store.put_and_wait(run)
    edit(file, "PRAGMA ignore_check_constraints = 1")
    try:
        edit(file, "UPDATE runs SET created_at = ? WHERE id = ?", value, run.id)
    except sqlite3.IntegrityError:
        return  # NULL is not even taken
    with pytest.raises(DamagedRecord):
        asyncio.run(store.get(run.id))


def test_a_damaged_response_is_never_replayed(store: RunStore, file: Path) -> None:
    run = make_record()
    store.put_and_wait(run, make_response(run))
    edit(file, "UPDATE idempotency_keys SET body = substr(body, 1, length(body) - 1)")
    with pytest.raises(DamagedRecord):
        asyncio.run(store.find_response("key-1", "a" * 64))


def test_a_corrupt_page_is_reported_permanently(store: RunStore, file: Path) -> None:
    for k in range(200):
        store.put_and_wait(make_record(k))
    store.close()
    with sqlite3.connect(file) as connection:
        connection.execute("PRAGMA journal_mode=DELETE")
    connection.close()
    with open(file, "r+b") as damaged:
        size = damaged.seek(0, os.SEEK_END)
        for page in range(12, size // 4096):
            damaged.seek(page * 4096)
            damaged.write(b"\xff" * 4096)
    with pytest.raises(StoreFault) as met, RunStore(f"sqlite:///{file}") as again:

        async def look() -> None:
            with pytest.raises(StoreFault):
                await again.list_runs(RunFilter(text="x"))
            await again.ping()

        asyncio.run(look())
    assert met.value.kind is FaultKind.DAMAGED


# -- faults -----------------------------------------------------------------------------------------------------


def test_a_full_database(store: RunStore) -> None:
    def bound(connection: Any) -> None:
        connection.exec_driver_sql("PRAGMA max_page_count = 1")

    store.put_and_wait(make_record())
    store.write_and_wait(bound)  # the writer keeps its connection
    large = make_record(result=b'"' + b"x" * 1_000_000 + b'"')

    async def write() -> FaultKind | None:
        return await fault_kind_of(store.put(large))

    assert asyncio.run(write()) is FaultKind.FULL
    assert store._fault is not None and store._fault.kind is FaultKind.FULL
    # Writes that still fit show that the fault is over.
    check_reported(store, None)
    with pytest.raises(UnknownRun):
        asyncio.run(store.get(large.id))


def test_a_locked_database_fails_all_waiting_writes_in_time_and_recovers(store: RunStore, file: Path) -> None:
    other = sqlite3.connect(file, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")

    async def crowd() -> list[FaultKind | None]:
        first = [asyncio.create_task(fault_kind_of(store.put(make_record(k)))) for k in range(3)]
        await asyncio.sleep(0.5)
        late = [asyncio.create_task(fault_kind_of(work)) for work in (store.put(make_record()), store.ping())]
        return list(await asyncio.gather(*first, *late))

    # A minute in the campaign: each time within the same seconds.
    for _ in range(12 if CAMPAIGN else 1):
        assert asyncio.run(crowd()) == [FaultKind.BUSY] * 5
    other.execute("ROLLBACK")
    other.close()
    check_reported(store, None)


@pytest.mark.parametrize("change", [lambda path: path.unlink(), lambda path: path.rename(path.with_name("elsewhere"))])
def test_a_missing_file_refuses_writes(store: RunStore, file: Path, change: Callable[[Path], Any]) -> None:
    check_reported(store, None)
    change(file)
    check_reported(store, FaultKind.GONE)
    upgrade(f"sqlite:///{file}")
    check_reported(store, FaultKind.GONE)


def test_a_database_that_turns_read_only(store: RunStore, file: Path) -> None:
    connections = [store._engine.connect() for _ in range(6)]
    for connection in connections:
        connection.exec_driver_sql("PRAGMA query_only = 1")
        connection.close()
    check_reported(store, FaultKind.READ_ONLY)


@pytest.mark.parametrize("database_url", ["postgresql"], indirect=True)
def test_a_locked_table_of_a_server(database_url: str) -> None:
    """SQLite has none."""
    engine = make_engine(database_url)
    with RunStore(database_url) as store, engine.connect() as other:
        other.execute(text("LOCK TABLE runs IN ACCESS EXCLUSIVE MODE"))

        async def all_at_once() -> list[FaultKind | None]:
            works = [store.put(make_record()), store.get("x" * 36), store.ping(), store.list_runs(RunFilter())]
            return list(await asyncio.gather(*map(fault_kind_of, works)))

        assert asyncio.run(all_at_once()) == [FaultKind.BUSY] * 4
        other.rollback()
        check_reported(store, None)
    engine.dispose()


# -- starts -----------------------------------------------------------------------------------------------------


def test_a_newer_database_is_refused(database_url: str) -> None:
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    engine.dispose()
    with pytest.raises(NewerDatabase, match="9999"):
        upgrade(database_url)


def test_an_invalid_folder_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no database, but long enough to be looked at as one" * 100)
    with pytest.raises(StoreFault) as met:
        upgrade(f"sqlite:///{tmp_path}/file")
    assert met.value.kind is FaultKind.DAMAGED
