"""Tables of results made from stored items."""

from __future__ import annotations

import asyncio
import csv
import io
import json
from pathlib import Path

import pyarrow.parquet

from app.batches.results import Format, Wanted, streamed, unanswered
from app.store.batch_records import BatchRecord
from app.store.migrate import upgrade
from app.store.repository import RunStore
from tests.app.store.test_batches import damage, finished


def table(store: RunStore, batch: BatchRecord, form: Format, wanted: Wanted = Wanted()) -> bytes:  # noqa: B008
    async def whole() -> bytes:
        return b"".join([part async for part in streamed(store, batch, wanted, form)])

    return asyncio.run(whole())


def test_a_damaged_item_is_a_row_that_says_so(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path}/runs.sqlite3"
    upgrade(url)
    with RunStore(url) as store:
        batch = asyncio.run(finished(store))
        damage(store, batch, 4)
        rows = [json.loads(line) for line in table(store, batch, Format.NDJSON).splitlines()]
        assert [row["status"] for row in rows] == ["succeeded"] * 4 + ["damaged"] + ["succeeded"] * 5
        assert rows[4]["run_id"] and rows[4]["holds"] is None and "x" not in rows[4]
        assert rows[4]["problem"].startswith("The record is damaged: ")
        cells = list(csv.DictReader(io.StringIO(table(store, batch, Format.CSV).decode())))
        assert [row["status"] for row in cells] == [row["status"] for row in rows] and cells[5]["x"] == "5"
        columns = pyarrow.parquet.read_table(io.BytesIO(table(store, batch, Format.PARQUET)))
        assert columns["status"].to_pylist() == [row["status"] for row in rows]
        only = Wanted(statuses=("succeeded",), fields=("index", "status"))
        assert len(table(store, batch, Format.NDJSON, only).splitlines()) == 10
        damage(store, batch, 5)
        assert asyncio.run(unanswered(store, batch, 10)) == []
