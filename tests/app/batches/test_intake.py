"""Rows of what is sent as a batch: cut out of a stream, in slices, packed and unpacked."""

from __future__ import annotations

import asyncio
import csv
import random

import pytest

from app.batches.intake import Lines, header_of, in_slices
from app.store.batch_inputs import Row, Source, packed_rows, unpacked_rows


def cut(data: bytes, size: int) -> list[Row]:
    """The rows of a CSV that arrives in parts of this size."""
    lines = Lines(quotes=True)
    rows = [row for k in range(0, len(data), size) for row in lines.feed(data[k : k + size])]
    return [*rows, *filter(None, [lines.end()])]


def test_lines_are_cut_the_same_however_they_arrive() -> None:
    data = b'\xef\xbb\xbf"a",b\r\n"1""\n2",3\n\n4,5'
    for size in range(1, len(data)):
        assert cut(data, size) == [Row(1, b'"a",b'), Row(2, b'"1""\n2",3'), Row(5, b"4,5")]


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_rows_end_where_the_csv_module_ends_them(delimiter: str) -> None:
    rng = random.Random(7)
    for _ in range(2000):
        text = "".join(rng.choices(['"', delimiter, "\n", "x"], [4, 2, 2, 3], k=rng.randint(1, 25)))
        table = f"a{delimiter}b\n{text}\n"
        reader = csv.reader(table.splitlines(keepends=True), delimiter=delimiter)
        ends = [reader.line_num for record in reader if any(record)]
        rows = cut(table.encode(), 5)
        found = [row.line + row.content.count(b"\n") for row in rows]
        # The csv module ends the last record with the text, here it lacks the line break.
        assert found[:-1] == ends[:-1] and len(found) == len(ends), table


@pytest.mark.parametrize("separator", ["\u2028", "\u2029", "\x85", "\x0b", "\x0c", "\x1c", "\x1d", "\x1e"])
def test_a_separator_that_ends_no_line_of_csv_is_text(separator: str) -> None:
    text = f"first{separator}second"
    header, row = cut(f"name,{text}\n{text},1\n".encode(), 1000)
    assert header_of(header) == (("name", text), ",")
    assert Source("csv", ("name", "x"), frozenset({"name"})).body(row) == {"name": text, "x": 1}


def test_an_inch_mark_in_a_cell_is_text() -> None:
    rows = [Row(1, b"name,bore_mm"), Row(2, b'bore 1/2" pin,12'), Row(3, b'bore 3/4" pin,19'), Row(4, b"last,20")]
    assert cut(b"\n".join(row.content for row in rows), 64) == rows
    source = Source("csv", ("name", "bore_mm"), frozenset({"name"}))
    assert source.body(rows[1]) == {"name": 'bore 1/2" pin', "bore_mm": 12}


@pytest.mark.parametrize("empty", [",,", ", ,", '"","",""', ",\r"])
def test_rows_of_empty_cells_are_left_out(empty: str) -> None:
    rows = cut(f"{empty}\na,b,c\n{empty}\n1,2,3\n{empty}\n\n".encode(), 64)
    assert rows == [Row(2, b"a,b,c"), Row(4, b"1,2,3")]
    assert cut(b'a,b\n"""",\n', 64) == [Row(1, b"a,b"), Row(2, b'"""",')]


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
