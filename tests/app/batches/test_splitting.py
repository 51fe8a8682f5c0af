"""Rows of NDJSON and CSV: where they end in a stream, however it arrives."""

from __future__ import annotations

import csv
import random
import time
from collections.abc import Iterator

import pytest

from app.batches.service import Asked, table_source
from app.batches.splitting import LONGEST_QUOTED, LONGEST_ROW, Lines, Records, header_of
from app.errors import Problem
from app.store.batch_inputs import Row, Source, UnreadableRow


def cut(data: bytes, size: int) -> list[Row]:
    """The rows of a CSV that arrives in parts of this size."""
    records = Records()
    rows = [row for k in range(0, len(data), size) for row in records.feed(data[k : k + size])]
    return [*rows, *records.end()]


def test_lines_are_cut_the_same_however_they_arrive() -> None:
    data = b'\xef\xbb\xbf"a",b\r\n"1""\n2",3\n\n4,5'
    for size in range(1, len(data)):
        assert cut(data, size) == [Row(1, b'"a",b'), Row(2, b'"1""\n2",3'), Row(5, b"4,5")]


def test_a_carriage_return_ends_a_line_of_csv_but_none_of_json() -> None:
    data = b'a,b\r1,"2\r3"\r\n\r4,5\r'
    for size in range(1, len(data)):
        assert cut(data, size) == [Row(1, b"a,b"), Row(2, b'1,"2\r3"'), Row(5, b"4,5")]
    assert [*Lines().feed(b'{"a":\r 1}\r\n')] == [Row(1, b'{"a":\r 1}')]


def ends_of(lines: list[str], delimiter: str) -> Iterator[int]:
    """The numbers of the lines with which rows that are not empty end, by the csv module; a row that it refuses ends
    with its first line."""
    first = 0
    while first < len(lines):
        reader = csv.reader(lines[first:], delimiter=delimiter, strict=True)
        try:
            record, size = next(reader), reader.line_num
        except csv.Error:
            record, size = ["refused"], 1
        first += size
        if any(record):
            yield first


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_rows_end_where_the_csv_module_ends_them(delimiter: str, end: str) -> None:
    rng = random.Random(7)
    for _ in range(1000):
        text = "".join(rng.choices(['"', delimiter, end, "x"], [4, 2, 2, 3], k=rng.randint(1, 25)))
        table = f"a{delimiter}b{end}{text}{end}"
        rows = cut(table.encode(), 5)
        found = [row.line + len(row.content.splitlines()[1:]) for row in rows]
        assert found == list(ends_of(table.splitlines(keepends=True), delimiter)), table


def test_a_stray_quotation_mark_spoils_no_row_but_its_own() -> None:
    table = [f'"row, {k}",{k}'.encode() for k in range(20_000)]
    for stray in (b'"row,1', b'a,"row'):
        table[9] = stray
        rows = cut(b"\n".join(table), 65_536)
        assert [row.line for row in rows] == list(range(1, 20_001))
        assert [row.content for row in rows if not row.unfit] == table[:9] + table[10:]
        assert rows[9].unfit == "has a quotation mark at the start of a cell that is not closed"


def test_every_line_is_read_twice_at_most() -> None:
    """Each of these is unclosed whether the line before it is, or not."""
    table = b'a",",b\n' * 50_000
    started = time.process_time()
    assert len(cut(table, 65_536)) == 50_000
    assert time.process_time() - started < 5.0


def test_a_quoted_cell_has_several_lines_up_to_a_length() -> None:
    def quoted(lines: int) -> bytes:
        return b'"' + lines * b"0123456789\n" + b'",1\n'

    most = (LONGEST_QUOTED - 5) // 11
    assert [row.unfit for row in cut(quoted(most), 4096)] == [None]
    assert len(cut(quoted(most + 1), 4096)) == most + 2


def test_an_overlong_line_ends_a_quoted_cell() -> None:
    rows = cut(b'"a\n' + LONGEST_ROW * b"x" + b"\n" + b"b,1\n", 65_536)
    assert [(row.line, row.content, bool(row.unfit)) for row in rows] == [
        (1, b"", True),
        (2, b"", True),
        (3, b"b,1", False),
    ]


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


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_empty_cells_at_the_ends_of_lines_are_no_columns(separator: str) -> None:
    """Spreadsheets write them for columns that were emptied."""
    header, full, short = cut(b"gap_mm,bore_mm,, \n1,12,,\n1,12\n".replace(b",", separator.encode()), 64)
    names, found = header_of(header)
    assert (names, found) == (("gap_mm", "bore_mm"), separator)
    source = Source("csv", names, delimiter=found)
    assert source.body(full) == source.body(short) == {"gap_mm": 1, "bore_mm": 12}
    with pytest.raises(UnreadableRow, match="has 4 cells where the header has 2"):
        source.body(Row(2, separator.join(("1", "12", "", "3")).encode()))


def test_a_column_without_a_name_is_refused_by_its_place() -> None:
    with pytest.raises(Problem) as refused:
        table_source(Asked("pin-profile", "check"), ("bore_mm", "", "load.force_n"), ",")
    assert refused.value.body["errors"][0]["detail"] == "has no name for column 2"
