"""Backups, pruning, expiry of idempotency keys, and compact responses."""

from __future__ import annotations

import asyncio
import sqlite3
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from typer.testing import CliRunner

from app import runs as shown
from app.cli import app
from app.store.backup import CannotCopy, backup, restore
from app.store.faults import StoreFault
from app.store.maintenance import ExpireKeys, Probe, Prune, lowest_id_at
from app.store.migrate import upgrade
from app.store.record import RunFilter, utc_now
from app.store.repository import RunStore
from app.store.response_codec import pack, unpack
from app.store.verify import verify
from tests.app.store.records import make_record, make_response
from tests.databases import sqlite_database


def fill(url: str, number: int = 5) -> list:
    records = [make_record(k) for k in range(number)]
    with RunStore(url) as store:
        for k, record in enumerate(records):
            store.put_and_wait(record, make_response(record, f"key-{k}"))
    return records


def ids(url: str) -> set[str]:
    with RunStore(url) as store:
        return {item.id for item in asyncio.run(store.list_runs(RunFilter())).items}


@pytest.mark.parametrize("mode", ["delete", "wal"])
def test_a_store_that_cannot_be_written_is_read_verified_and_copied(tmp_path: Path, monkeypatch, mode: str) -> None:
    url, file = sqlite_database(tmp_path), tmp_path / "runs.sqlite3"
    records = fill(url)
    with closing(sqlite3.connect(file)) as database:
        database.execute(f"PRAGMA journal_mode={mode}")
    stored = file.read_bytes()
    monkeypatch.setattr("app.store.engine.os.access", lambda _path, _right: False)
    assert ids(url) == {record.id for record in records}
    assert verify(url).sound and backup(url, tmp_path / "copy.sqlite3").sound
    with pytest.raises(StoreFault, match="cannot be written"), RunStore(url) as store:
        store.write_and_wait(Probe())
    assert file.read_bytes() == stored and not list(tmp_path.glob("runs.sqlite3-*"))


def test_a_backup_of_a_store_in_use_restores_completely(tmp_path: Path) -> None:
    url, copy = sqlite_database(tmp_path), tmp_path / "backup.sqlite3"
    records = fill(url)
    with RunStore(url) as store:
        store.put_and_wait(make_record(9))  # in the journal still
        assert backup(url, copy).runs == 6
        store.put_and_wait(make_record(10))
    assert not list(tmp_path.glob("backup*-*")), "one file"
    with pytest.raises(CannotCopy, match="not overwritten"):
        backup(url, copy)
    with pytest.raises(CannotCopy, match="not overwritten"):
        restore(url, copy)
    elsewhere = f"sqlite:///{tmp_path}/restored/runs.sqlite3"
    assert restore(elsewhere, copy).sound
    assert {record.id for record in records} < ids(elsewhere) and len(ids(elsewhere)) == 6
    assert verify(elsewhere).sound


def test_a_backup_of_a_damaged_store_is_reported(tmp_path: Path) -> None:
    url = sqlite_database(tmp_path)
    fill(url)
    with sqlite3.connect(tmp_path / "runs.sqlite3") as connection:
        connection.execute("UPDATE runs SET name = 'other'")
    connection.close()
    told = CliRunner().invoke(app, ["backup", str(tmp_path / "copy"), "--database-url", url])
    assert told.exit_code == 1 and "DAMAGED" in told.stdout and (tmp_path / "copy").exists()


def test_pruning_is_explicit_counted_and_audited(database_url: str) -> None:
    old = [make_record(k, created_at=utc_now() - timedelta(days=400)) for k in range(3)]
    still_open = make_record(7, created_at=old[0].created_at, status="queued", result=None)
    with RunStore(database_url) as store:
        for k, record in enumerate([*old, still_open]):
            store.put_and_wait(record, make_response(record, f"old-{k}"))
    kept = {record.id for record in fill(database_url)} | {still_open.id}
    before = (utc_now() - timedelta(days=100)).strftime("%Y-%m-%d")
    words = ["prune", "--before", before, "--database-url", database_url]
    assert "3 runs would be deleted" in CliRunner().invoke(app, words).stdout
    assert len(ids(database_url)) == 9
    assert "3 runs were deleted" in CliRunner().invoke(app, [*words, "--yes"]).stdout
    assert ids(database_url) == kept
    assert verify(database_url).sound
    assert "prune" in CliRunner().invoke(app, ["audit", "--database-url", database_url]).stdout


def test_other_deletions_are_detected(database_url: str) -> None:
    from sqlalchemy import text

    from app.store.engine import make_engine

    upgrade(database_url)
    fill(database_url)
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.execute(text("DELETE FROM idempotency_keys"))
        connection.execute(text("DELETE FROM runs WHERE spec_hash IN (SELECT spec_hash FROM runs LIMIT 2)"))
    engine.dispose()
    assert [damage.what for damage in verify(database_url).damages] == ["2 runs are missing that were stored"]


def test_idempotency_keys_expire(database_url: str) -> None:
    fill(database_url, 2)
    later = make_record(5)
    with RunStore(database_url, key_lifetime=timedelta(days=1)) as store:

        async def look() -> None:
            assert await store.find_response("key-0", "a" * 64) is not None
            assert await store.expire_keys() == 0
            store._key_lifetime = timedelta(0)
            assert await store.find_response("key-0", "a" * 64) is None
            # The same key may be used again, also before it was taken out.
            assert await store.put(later, make_response(later, "key-0", "b" * 64)) is None
            store._key_lifetime = timedelta(days=1)
            assert (await store.find_response("key-0", "b" * 64)).run_id == later.id

        asyncio.run(look())
        assert store.write_and_wait(ExpireKeys(utc_now() + timedelta(seconds=1))) >= 1
    assert verify(database_url).sound


def test_ids_sort_by_time() -> None:
    moment = utc_now()
    assert lowest_id_at(moment - timedelta(seconds=1)) < make_record().id < lowest_id_at(moment + timedelta(seconds=10))


def test_a_stored_response_omits_the_runs_parts(tmp_path: Path) -> None:
    result = b'{"curve":[' + b",".join(b"%d.25" % k for k in range(3000)) + b"]}"
    other = {"kind": "none of today's"}
    statuses = ({"result": result}, {"status": "failed", "result": None}, {"status": "queued"})
    for run in [make_record(**other, **changes) for changes in statuses]:
        body = shown.run_json(run)
        assert unpack(pack(body, run), run) == body
    run = make_record(result=result, **other)
    assert len(pack(shown.run_json(run), run)) < 1000 < len(result)
    assert unpack(b'{"whole":1}', run) == b'{"whole":1}', "as former versions kept them"
    # Parts that change when a run ends are stored in full.
    queued = make_record(status="queued", result=None)
    kept, body = pack(shown.run_json(queued), queued), shown.run_json(queued)
    assert unpack(kept, replace(queued, status="succeeded", result=result, effects=b"[1]")) == body
    with pytest.raises(ValueError):
        unpack(kept[:-3], queued)


def test_pruning_is_limited_per_transaction(database_url: str) -> None:
    with RunStore(database_url) as store:
        assert store.write_and_wait(Prune(utc_now(), "a test")) == 0
