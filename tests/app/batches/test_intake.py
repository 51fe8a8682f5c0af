"""Rows of what is sent as a batch: in slices, packed and unpacked."""

from __future__ import annotations

import asyncio

from app.batches.intake import in_slices
from app.store.batch_inputs import Row, Source, packed_rows, unpacked_rows


def test_no_row_is_lost_between_slices() -> None:
    async def sizes() -> list[int]:
        return [len(some) async for some in in_slices(iter([Row(k, b"") for k in range(2500)]))]

    assert asyncio.run(sizes()) == [1000, 1000, 500]


def test_rows_come_back_as_they_were_packed() -> None:
    rows = [Row(3, b'{"a":\r 1}'), Row(None, b""), Row(9, "ä".encode(), "is too long")]
    assert unpacked_rows(packed_rows(rows)) == rows
    assert unpacked_rows(packed_rows(rows), 1, 3) == rows[1:]
    source = Source("csv", ("a.0", "a.1", "b"), frozenset({"b"}))
    assert Source.from_json(source.to_json()) == source
    assert source.body(Row(1, b"1,[2],3")) == {"a": [1, [2]], "b": "3"}
