"""Group commit: sharing, back-pressure, database faults, cancelled submitters."""

from __future__ import annotations

import asyncio
import sqlite3
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from sqlalchemy import Connection, Engine, event, select
from sqlalchemy.exc import IntegrityError, OperationalError

from app.store.engine import make_engine
from app.store.errors import StoreClosed
from app.store.faults import FaultKind
from app.store.models import ledger, runs
from app.store.operations import INSERT_RUN, Put
from app.store.repository import RunStore
from app.store.rows import run_to_row
from app.store.verify import verify
from app.store.writer import GroupWriter
from tests.app.store.records import make_record
from tests.databases import sqlite_database


@pytest.fixture
def url(tmp_path: Path) -> str:
    return sqlite_database(tmp_path)


@pytest.fixture
def engine(url: str) -> Iterator[Engine]:
    engine = make_engine(url)
    yield engine
    engine.dispose()


def test_many_submissions_share_few_commits(engine: Engine) -> None:
    commits = []
    writer = GroupWriter(engine, on_commit=lambda _seconds, _fault: commits.append(1))

    async def crowd():
        await asyncio.gather(*(writer.submit(Put(make_record(k))) for k in range(200)))

    asyncio.run(crowd())
    writer.close()
    assert 1 <= len(commits) <= 20


def test_a_failure_reaches_only_its_submitter(engine: Engine) -> None:
    writer = GroupWriter(engine)
    hold = threading.Event()

    def refuse(connection: object) -> None:
        raise LookupError("mine")

    async def crowd():
        first = asyncio.create_task(writer.submit(lambda connection: hold.wait(10)))
        rest = [asyncio.create_task(writer.submit(Put(make_record(k)))) for k in range(3)]
        rest.insert(1, asyncio.create_task(writer.submit(refuse)))
        await asyncio.sleep(0.05)
        hold.set()
        return await asyncio.gather(first, *rest, return_exceptions=True)

    held, one, failed, two, three = asyncio.run(crowd())
    writer.close()
    assert held is True and one is two is three is None
    assert isinstance(failed, LookupError)


def test_submitters_beyond_the_capacity_wait(url: str) -> None:
    async def crowd():
        with RunStore(url, write_capacity=3) as store:
            await asyncio.gather(*(store.put(make_record(k)) for k in range(50)))

    asyncio.run(crowd())
    assert verify(url).runs == 50


def sqlite_error(code: int) -> sqlite3.OperationalError:
    error = sqlite3.OperationalError("the driver's words")
    error.sqlite_errorcode = code
    return error


def test_a_database_fault_reaches_all_submitters_and_recovers(engine: Engine, url: str) -> None:
    kind = [True]

    class Failing(GroupWriter):
        @contextmanager
        def _transaction(self) -> Iterator[Connection]:
            with super()._transaction() as connection:
                yield connection
                if kind[0]:
                    raise OperationalError("COMMIT", {}, sqlite_error(sqlite3.SQLITE_FULL))

    writer = Failing(engine)

    async def crowd():
        failed = await asyncio.gather(*(writer.submit(Put(make_record(k))) for k in range(5)), return_exceptions=True)
        kind[0] = False
        await writer.submit(Put(make_record()))
        return failed

    failed = asyncio.run(crowd())
    writer.close()
    assert [each.kind for each in failed] == [FaultKind.FULL] * 5
    assert verify(url).runs == 1


def test_a_cancelled_submitter_does_not_affect_others(engine: Engine, url: str) -> None:
    writer = GroupWriter(engine)

    async def crowd():
        impatient = asyncio.create_task(writer.submit(Put(make_record())))
        patient = asyncio.create_task(writer.submit(Put(make_record())))
        await asyncio.sleep(0)
        impatient.cancel()
        await patient

    asyncio.run(crowd())
    writer.close()
    assert verify(url).runs == 2


def test_a_closed_writer_refuses_writes(engine: Engine) -> None:
    writer = GroupWriter(engine)
    writer.close()
    with pytest.raises(StoreClosed):
        asyncio.run(writer.submit(Put(make_record())))


def test_code_without_an_event_loop_can_write(url: str) -> None:
    record = make_record()
    with RunStore(url) as store:
        assert store.put_and_wait(record) is None
    assert verify(url).runs == 1


@pytest.mark.parametrize("database_url", ["postgresql"], indirect=True)
def test_deadlocked_groups_are_both_written(database_url: str) -> None:
    """SQLite has a single writer."""
    engines = [make_engine(database_url) for _ in range(2)]
    with engines[0].begin() as connection:
        connection.exec_driver_sql("INSERT INTO ledger (id, runs, probe) VALUES (2, 0, 0)")
    both_hold_one, begun = threading.Barrier(2), [threading.Event(), threading.Event()]

    def touch(row: int, hold: bool = False) -> Callable[[Connection], None]:
        def operation(connection: Connection) -> None:
            connection.exec_driver_sql(f"UPDATE ledger SET probe = probe + 1 WHERE id = {row}")
            if hold:
                with suppress(threading.BrokenBarrierError):
                    both_hold_one.wait(2.0)

        return operation

    async def one_group(writer: GroupWriter, mine: int, others: int) -> None:
        loop = asyncio.get_running_loop()
        first = loop.create_task(writer.submit(lambda _: begun[mine - 1].wait(10)))
        await asyncio.sleep(0.2)  # the writer is busy: what comes now is one group
        group = [loop.create_task(writer.submit(touch(mine, True))), loop.create_task(writer.submit(touch(others)))]
        await asyncio.sleep(0.2)
        begun[mine - 1].set()
        await asyncio.gather(first, *group)

    async def both() -> None:
        await asyncio.gather(one_group(writers[0], 1, 2), one_group(writers[1], 2, 1))

    collisions = []
    for engine in engines:
        event.listen(
            engine, "handle_error", lambda context: collisions.append(type(context.original_exception).__name__)
        )
    writers = [GroupWriter(engine) for engine in engines]
    asyncio.run(both())
    for writer in writers:
        writer.close()
    assert collisions == ["DeadlockDetected"]
    with engines[0].connect() as connection:
        assert connection.exec_driver_sql("SELECT probe FROM ledger ORDER BY id").scalars().all() == [2, 2]
    for engine in engines:
        engine.dispose()


def test_a_failed_insertion_leaves_nothing_of_its_transaction(engine: Engine) -> None:
    first, second = make_record(), make_record()
    writer = GroupWriter(engine)
    writer.submit_and_wait(Put(first))

    def twice(connection: Connection) -> None:
        INSERT_RUN(connection, run_to_row(second), run_to_row(first))

    with pytest.raises(IntegrityError):
        writer.submit_and_wait(twice)
    writer.close()
    with engine.connect() as connection:
        assert connection.execute(select(runs.c.id)).scalars().all() == [first.id]
        assert connection.execute(select(ledger.c.runs)).scalar() == 1
