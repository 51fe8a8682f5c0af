"""The service is killed during writes: every acknowledged row is present and intact."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path

from app.store.record import RunFilter
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.store.records import make_record
from tests.child_processes import die_with_test_runner

SERVICE = """
import asyncio, sys
from app.store.repository import RunStore
from tests.app.store.records import make_record, make_response

async def submit(store, number):
    record = make_record(number)
    await store.put(record, make_response(record, key=record.id) if number % 2 else None)
    print(record.id, flush=True)

async def main():
    store = RunStore(sys.argv[1])
    number = 0
    while True:
        await asyncio.gather(*(submit(store, number + k) for k in range(20)))
        number += 20

asyncio.run(main())
"""


def test_no_acknowledged_run_is_lost_when_the_service_is_killed(database_url: str) -> None:
    acknowledged: set[str] = set()
    for wanted in (30, 111):
        service = subprocess.Popen(
            [sys.executable, "-c", SERVICE, database_url],
            stdout=subprocess.PIPE,
            cwd=Path.cwd(),
            bufsize=0,
            preexec_fn=die_with_test_runner(),
        )
        assert service.stdout is not None
        output = b""
        while output.count(b"\n") < wanted:
            chunk = service.stdout.read(64)
            assert chunk, "the service ended by itself"
            output += chunk
        service.kill()
        output += service.stdout.read() or b""
        service.wait()
        service.stdout.close()
        # A line that is cut short was not acknowledged.
        acknowledged |= {line.decode() for line in output.split(b"\n")[:-1]}

    async def stored() -> set[str]:
        found: set[str] = set()
        with RunStore(database_url) as store:
            cursor = None
            while True:
                page = await store.list_runs(RunFilter(), cursor, 200)
                found |= {item.id for item in page.items}
                cursor = page.next_cursor
                if cursor is None:
                    return found

    assert len(acknowledged) >= 141
    assert acknowledged <= asyncio.run(stored())
    report = verify(database_url)
    assert report.sound, report.damages


def test_commits_are_synchronous(database_url: str) -> None:
    """Killing cannot prove safety against power failure; the synchronous setting can be read back."""
    store = RunStore(database_url)
    try:
        if database_url.startswith("sqlite"):
            full = 2
            expected = {"journal_mode": "wal", "synchronous": full, "foreign_keys": 1, "busy_timeout": 4_000}
            read = {name: store.read(lambda c, n=name: c.exec_driver_sql(f"PRAGMA {n}").scalar()) for name in expected}
            assert read == expected
        else:
            assert store.read(lambda c: c.exec_driver_sql("SHOW synchronous_commit").scalar()) == "on"
    finally:
        store.close()


def test_closing_commits_pending_writes(database_url: str) -> None:
    async def close_early():
        store = RunStore(database_url)
        tasks = [asyncio.create_task(store.put(make_record(k))) for k in range(300)]
        await asyncio.sleep(0)
        await asyncio.to_thread(store.close)
        await asyncio.gather(*tasks)

    asyncio.run(close_early())
    assert verify(database_url).runs == 300
