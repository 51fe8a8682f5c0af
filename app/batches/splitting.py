"""Rows of NDJSON and CSV, cut out of a byte stream without parsing them."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence

from app.store.batch_inputs import Row, record

LONGEST_ROW, LONGEST_QUOTED = 1_000_000, 100_000
"""Lengths [bytes] of a line, and of a row of several lines, which quotation marks hold together."""
_TOO_LONG = f"is longer than {LONGEST_ROW} bytes"
_NOT_CLOSED = "has a quotation mark at the start of a cell that is not closed"
_BOM = b"\xef\xbb\xbf"
_DELIMITERS = (b",", b";", b"\t")
_QUOTED = rb'"[^"]*+(?:""[^"]*+)*+'
"""A quoted cell without its end. A quotation mark quotes only at the start of a cell, where doubled ones are text until
a single one; any other, such as that of 1/2", is text."""
_CELL = rb"(?:" + _QUOTED + rb'"|(?!")[^%b]*+)'
_CLOSED = {each: re.compile((_CELL + rb"(?:%b" + _CELL + rb")*+[\r\n]*+") % (each, each, each)) for each in _DELIMITERS}
"""Text whose quoted cells all end before a delimiter or the end of a line."""
_UNCLOSED = {each: re.compile((rb"(?:" + _CELL + rb"%b)*+" + _QUOTED) % (each, each)) for each in _DELIMITERS}
"""Text that ends within a quoted cell."""
_EMPTY_CELLS = {each: re.compile(rb'(?:\s|%b|""(?!"))*+' % each) for each in _DELIMITERS}


class Lines:
    """Splits a byte stream into rows: its lines, numbered from 1, without blank ones. The content of an overlong line
    is discarded."""

    _ends: tuple[bytes, ...] = (b"\n",)

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        """The current line as far as it has arrived."""
        self._size, self._number = 0, 1

    def feed(self, data: bytes) -> Iterator[Row]:
        """The rows completed by ``data``."""
        for piece in self._pieces(data):
            self._size += len(piece)
            if self._size > LONGEST_ROW:
                self._parts.clear()
            else:
                self._parts.append(piece)
            if piece.endswith(self._ends):
                yield from self._rows(self._line())

    def end(self) -> Iterator[Row]:
        """The rows that end with the stream."""
        if self._size:
            yield from self._rows(self._line())

    def _pieces(self, data: bytes) -> Iterator[bytes]:
        """The lines of ``data`` with their ends, which the last may lack."""
        return iter(io.BytesIO(data))

    def _line(self) -> Row:
        """The current line; the next one begins."""
        content, size, number = b"".join(self._parts), self._size, self._number
        self._parts.clear()
        self._size, self._number = 0, number + 1
        if number == 1:
            content = content.removeprefix(_BOM)
        return Row(number, content, _TOO_LONG if size > LONGEST_ROW else None)

    def _rows(self, line: Row) -> Sequence[Row]:
        """The rows completed by a line."""
        content = line.content.strip(b"\r\n")
        empty = line.unfit is None and not content.strip()
        return () if empty else (Row(line.line, content, line.unfit),)


class Records(Lines):
    """Splits a CSV into rows, numbered by their first lines and without those whose cells are all empty.

    Lines end with a line feed, a carriage return or both; within a quoted cell they do not end the row. Where such a
    cell is not closed, its lines are rows of their own: a stray quotation mark spoils no row but its own.
    """

    _ends = (b"\n", b"\r")

    def __init__(self) -> None:
        super().__init__()
        self._delimiter: bytes | None = None
        self._held = b""
        """A carriage return at the end of a part, which a line feed may follow."""
        self._open: list[Row] = []
        """The lines of the current row, which ends within a quoted cell so far."""
        self._open_size = 0

    def end(self) -> Iterator[Row]:
        self._size += len(self._held)
        self._held = b""
        yield from super().end()
        yield from self._given_up()

    def _pieces(self, data: bytes) -> Iterator[bytes]:
        data = self._held + data
        self._held = b"\r" if data.endswith(b"\r") else b""
        return iter(data.removesuffix(self._held).splitlines(keepends=True))

    def _rows(self, line: Row) -> Sequence[Row]:
        if self._delimiter is None and line.content.strip():
            self._delimiter = _delimiter_of(line.content)
        if self._open:
            return self._continued(line)
        if self._is_unclosed(line.content):
            self._open.append(line)
            self._open_size = len(line.content)
            return ()
        return self._alone(line)

    def _continued(self, line: Row) -> Sequence[Row]:
        """The rows completed by a line that begins within a quoted cell."""
        self._open_size += len(line.content)
        quoted = b'"' + line.content
        if line.unfit is None and self._open_size <= LONGEST_QUOTED:
            if self._is_unclosed(quoted):
                self._open.append(line)
                return ()
            if _CLOSED[self._separator].fullmatch(quoted):
                content = b"".join(each.content for each in [*self._open, line])
                number = self._open[0].line
                self._open.clear()
                return (Row(number, content.strip(b"\r\n")),)
        return [*self._given_up(), *self._rows(line)]

    def _given_up(self) -> Sequence[Row]:
        """The lines of the current row as rows of their own."""
        lines, self._open = self._open, []
        marked = (
            Row(line, b"", _NOT_CLOSED) if self._is_unclosed(text) else Row(line, text) for line, text, _ in lines
        )
        return [row for line in marked for row in self._alone(line)]

    def _alone(self, line: Row) -> Sequence[Row]:
        """A line as a row of its own."""
        content = line.content.strip(b"\r\n")
        empty = line.unfit is None and _EMPTY_CELLS[self._separator].fullmatch(content)
        return () if empty else (Row(line.line, content, line.unfit),)

    def _is_unclosed(self, text: bytes) -> bool:
        return b'"' in text and _UNCLOSED[self._separator].fullmatch(text) is not None

    @property
    def _separator(self) -> bytes:
        return self._delimiter or _DELIMITERS[0]


def _delimiter_of(line: bytes) -> bytes:
    """What separates the cells of a table with this first line: a comma, else a semicolon or a tab, as spreadsheets
    write where numbers have decimal commas."""
    return next((each for each in _DELIMITERS if each in line), _DELIMITERS[0])


def header_of(row: Row) -> tuple[tuple[str, ...], str]:
    """The column names in the first row of a CSV, without the empty cells that spreadsheets leave at its end, and what
    separates them. Raises UnreadableRow."""
    first = row.content.partition(b"\n")[0].partition(b"\r")[0]
    delimiter = _delimiter_of(first).decode()
    names = [name.strip() for name in record(row, delimiter)]
    return tuple(names[: max((k for k, name in enumerate(names, 1) if name), default=0)]), delimiter
