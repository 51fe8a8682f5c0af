"""Tables of results made from stored items."""

from __future__ import annotations

import asyncio
import csv
import io
import json
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest

from app.batches.results import Format, Wanted, streamed, unanswered
from app.store.batch_items import encoded, packed, sealed
from app.store.batch_operations import Claim, Finish
from app.store.batch_records import BatchRecord, Item
from app.store.hashing import canonical_json
from app.store.migrate import upgrade
from app.store.repository import RunStore
from tests.app.store.test_batches import damage, finished, received


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


@pytest.mark.parametrize(
    ("bores", "columns"),
    [
        ([(9.0, 9.0), (9.0, 8.5)], {"spec.profile.1.bore_mm": [9.0, 8.5]}),
        ([(9.0,), (9.0, 8.5)], {"spec.profile.1.x_mm": [None, 1.0], "spec.profile.1.bore_mm": [None, 8.5]}),
        ([17 * (9.0,), 17 * (8.0,)], None),
    ],
    ids=["entries", "lengths", "long arrays"],
)
def test_arrays_in_which_lines_of_json_differ_are_columns(
    tmp_path: Path, bores: list[tuple[float, ...]], columns: dict[str, Any] | None
) -> None:
    profiles = [[{"bore_mm": bore, "x_mm": float(k)} for k, bore in enumerate(each)] for each in bores]
    columns = columns or {"spec.profile": [json.dumps(each) for each in profiles]}

    async def story(store: RunStore) -> BatchRecord:
        batch = await received(store, 2, blocks=1)
        (chunk,) = await store.write(Claim(batch.number, "a", 30.0, 2, 100))
        contents = [packed(encoded(canonical_json({"profile": each}), {}), batch.dictionary) for each in profiles]
        items = [Item(k, k + 1, "succeeded", None, None, content) for k, content in enumerate(contents)]
        await store.write(Finish(chunk, "a", sealed(batch.number, items)))
        return batch

    url = f"sqlite:///{tmp_path}/runs.sqlite3"
    upgrade(url)
    with RunStore(url) as store:
        batch = asyncio.run(story(store))
        rows = [json.loads(line) for line in table(store, batch, Format.NDJSON).splitlines()]
        assert {name: [row[name] for row in rows] for name in rows[0] if name.startswith("spec.profile")} == columns
        kept = pyarrow.parquet.read_table(io.BytesIO(table(store, batch, Format.PARQUET)))
        assert {name: kept[name].to_pylist() for name in columns} == columns
