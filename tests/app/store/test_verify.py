"""Verification detects every kind of damage and passes intact stores."""

from __future__ import annotations

import asyncio
import sqlite3
from pathlib import Path

import pytest

from app.store.engine import make_engine
from app.store.models import idempotency_keys, runs
from app.store.record import RunRecord
from app.store.repository import RunStore
from app.store.verify import verify
from tests.app.store.records import make_record, make_response
from tests.databases import sqlite_database

RECORDS = 5


def fill(url: str) -> list[RunRecord]:
    records = [make_record(k, batch_id="b" * 36, source_run_ids=("s" * 36,), owner="a key") for k in range(RECORDS)]
    records[1] = make_record(1, result=None, problem=b'{"title":"no"}', accuracy=None)

    async def put():
        with RunStore(url) as store:
            for number, record in enumerate(records):
                await store.put(record, make_response(record, key=f"key-{number}"))

    asyncio.run(put())
    return records


@pytest.fixture
def sqlite_file(tmp_path: Path) -> Path:
    sqlite_database(tmp_path)
    return tmp_path / "runs.sqlite3"


def execute(path: Path, statement: str, *parameters: object) -> None:
    connection = sqlite3.connect(path)
    connection.execute(statement, parameters)
    connection.commit()
    connection.close()


def test_an_intact_store_passes(database_url: str) -> None:
    fill(database_url)
    report = verify(database_url)
    assert report.sound and (report.runs, report.idempotency_keys) == (RECORDS, RECORDS)


def test_an_edited_row_is_detected_on_every_database(database_url: str) -> None:
    records = fill(database_url)
    engine = make_engine(database_url)
    with engine.begin() as connection:
        connection.execute(runs.update().where(runs.c.id == records[2].id).values(result=b'{"fatigue_safety": 9.70}'))
        connection.execute(idempotency_keys.update().where(idempotency_keys.c.key == "key-3").values(body=b"{}"))
    engine.dispose()
    assert {(damage.table, damage.key) for damage in verify(database_url).damages} == {
        ("runs", records[2].id),
        ("idempotency_keys", "key-3"),
    }


RUN_COLUMNS = [column.name for column in runs.columns if column.name not in ("created_at", "cached", "holds", "figure")]


@pytest.mark.parametrize("column", RUN_COLUMNS)
def test_a_flipped_bit_in_any_column_is_detected(sqlite_file: Path, column: str) -> None:
    records = fill(f"sqlite:///{sqlite_file}")
    connection = sqlite3.connect(sqlite_file)
    connection.text_factory = bytes
    where = f"WHERE {column} IS NOT NULL AND id = ?"
    number = 1 if column == "problem" else 2
    (value,) = connection.execute(f"SELECT {column} FROM runs {where}", (records[number].id,)).fetchone()
    flipped = bytes([value[0] ^ 0x80]) + value[1:] if column != "name" else value[:-1] + bytes([value[-1] ^ 1])
    text = f"CAST(? AS {'BLOB' if column in BINARY else 'TEXT'})"
    connection.execute(f"UPDATE runs SET {column} = {text} {where}", (flipped, records[number].id))
    connection.commit()
    connection.close()
    report = verify(f"sqlite:///{sqlite_file}")
    assert any(damage.table == "runs" for damage in report.damages)


BINARY = {"spec", "result", "problem", "effects", "accuracy", "timing", "source_run_ids", "verdict"}


@pytest.mark.parametrize(
    ("assignment", "expected"),
    [
        ("result = NULL", "row hash"),
        ("cached = 1", "row hash"),
        ("holds = 0", "row hash"),
        ("figure = 2.6", "row hash"),
        ("created_at = '2020-01-01 00:00:00.000000'", "row hash"),
        ("created_at = 'yesterday'", "cannot be read"),
        ("result = substr(result, 1, 10)", "result is not valid JSON"),
        ("spec = X'7b7d'", "spec hash"),
        ("spec = 'text instead of bytes'", "row hash"),
        ("result = 3.5", "row hash"),
    ],
)
def test_edits_are_detected_and_described(sqlite_file: Path, assignment: str, expected: str) -> None:
    records = fill(f"sqlite:///{sqlite_file}")
    execute(sqlite_file, f"UPDATE runs SET {assignment} WHERE id = ?", records[0].id)
    report = verify(f"sqlite:///{sqlite_file}")
    assert any(expected in damage.what for damage in report.damages), report.damages
    assert {damage.key for damage in report.damages} == {records[0].id}


def test_a_flipped_byte_in_the_file_is_detected(sqlite_file: Path) -> None:
    """Not detected by SQLite's integrity check."""
    fill(f"sqlite:///{sqlite_file}")
    execute(sqlite_file, "PRAGMA wal_checkpoint(TRUNCATE)")
    content = bytearray(sqlite_file.read_bytes())
    place = content.index(b'"fatigue_safety": 2.70')
    content[place + len('"fatigue_safety": ')] ^= 1
    sqlite_file.write_bytes(content)
    assert sqlite3.connect(sqlite_file).execute("PRAGMA integrity_check").fetchone() == ("ok",)
    assert [damage.what for damage in verify(f"sqlite:///{sqlite_file}").damages] == [
        "the content does not match its row hash"
    ]


def test_missing_columns_and_tables_are_reported(sqlite_file: Path) -> None:
    fill(f"sqlite:///{sqlite_file}")
    execute(sqlite_file, "ALTER TABLE runs DROP COLUMN accuracy")
    execute(sqlite_file, "DROP TABLE idempotency_keys")
    assert {(damage.table, damage.what) for damage in verify(f"sqlite:///{sqlite_file}").damages} == {
        ("runs", "the column accuracy is missing"),
        ("idempotency_keys", "the table is missing"),
    }


def test_a_missing_run_of_a_stored_response_is_reported(sqlite_file: Path) -> None:
    records = fill(f"sqlite:///{sqlite_file}")
    execute(sqlite_file, "DELETE FROM runs WHERE id = ?", records[4].id)
    report = verify(f"sqlite:///{sqlite_file}")
    assert [damage.what for damage in report.damages] == [
        "1 runs are missing that were stored",
        "refers to a row of runs that does not exist",
    ]


def test_a_file_that_is_no_database_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "runs.sqlite3"
    path.write_bytes(b"This was a database once." * 400)
    report = verify(f"sqlite:///{path}")
    assert not report.sound and "cannot be read" in report.damages[0].what


def test_a_truncated_file_is_reported(sqlite_file: Path) -> None:
    fill(f"sqlite:///{sqlite_file}")
    execute(sqlite_file, "PRAGMA wal_checkpoint(TRUNCATE)")
    content = sqlite_file.read_bytes()
    sqlite_file.write_bytes(content[: len(content) // 2])
    assert not verify(f"sqlite:///{sqlite_file}").sound


def test_a_damaged_response_is_not_replayed(sqlite_file: Path) -> None:
    url = f"sqlite:///{sqlite_file}"
    record = fill(url)[3]
    execute(sqlite_file, "UPDATE runs SET result = X'7b7d' WHERE id = ?", record.id)

    async def find():
        with RunStore(url) as store:
            return await store.find_answer(record.spec_hash, record.solver_name, record.solver_version)

    assert asyncio.run(find()) is None
