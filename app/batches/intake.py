"""Streaming intake of batches: split the body into rows without parsing them, and pack the rows into blocks."""

from __future__ import annotations

import asyncio
import csv
import io
import re
import time
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

from app.errors import Problem
from app.store.batch_inputs import Row, packed_rows
from app.store.batch_operations import RECEIVING_S, Receive
from app.store.batch_records import Block
from app.store.repository import RunStore

LONGEST_ROW = 1_000_000
_BLOCK_ROWS, _BLOCK_BYTES = 5000, 2 * 2**20
"""Block limits [rows, bytes]. A chunk lies in one block, so a block must hold a chunk of the fastest kind."""
_BLOCKS_PER_WRITE = 4
_LONGEST_REST_S = 0.1
_TOO_LONG = f"is longer than {LONGEST_ROW} bytes"
_BOM = b"\xef\xbb\xbf"
_DELIMITERS = (b",", b";", b"\t")
_CELL = rb'(?:"[^"]*+(?:""[^"]*+)*+"|(?!"))[^%b]*+'
"""A complete cell of a CSV. A quotation mark quotes only at its start, where doubled ones are text until a single one;
any other, such as that of 1/2", is text."""
_CELLS = {each: re.compile(_CELL % each + rb"(?:" + each + _CELL % each + rb")*+") for each in _DELIMITERS}
_EMPTY_CELLS = {each: re.compile(rb'(?:\s|%b|""(?!"))*+' % each) for each in _DELIMITERS}

_THREAD = ThreadPoolExecutor(1, thread_name_prefix="batch-intake")
T = TypeVar("T")


_waiting = 0


async def aside(call: Callable[[], T]) -> T:
    """Run a call on the one thread for incoming rows.

    However many batches arrive at once, they take no more of the service's time from other requests than one of them;
    and a third of that where several do, since the thread then rests twice as long as it worked.
    """
    global _waiting
    _waiting += 1
    try:
        return await asyncio.get_running_loop().run_in_executor(_THREAD, _then_rest, call)
    finally:
        _waiting -= 1


def _then_rest(call: Callable[[], T]) -> T:
    started = time.monotonic()
    try:
        return call()
    finally:
        if _waiting > 1:
            time.sleep(min(2.0 * (time.monotonic() - started), _LONGEST_REST_S))


class Lines:
    """Splits a byte stream into rows numbered by their first lines, from 1; the content of an overlong row is
    discarded, and rows without content are left out.

    ``quotes`` enables CSV quoting, where a line break between quotes does not end a row. A row of a CSV whose cells are
    all empty has no content.
    """

    def __init__(self, quotes: bool) -> None:
        self._quotes = quotes
        self._delimiter: bytes | None = None
        self._lines: list[bytes] = []
        """The complete lines of the current row."""
        self._parts: list[bytes] = []
        """The current line as far as it has arrived."""
        self._size, self._line, self._first, self._open = 0, 1, 1, False

    def feed(self, data: bytes) -> Iterator[Row]:
        """The rows completed by ``data``."""
        pieces = data.split(b"\n")
        for piece in pieces[:-1]:
            self._keep(piece + b"\n")
            self._end_line()
            if self._open and self._size <= LONGEST_ROW:
                continue
            row = self._row()
            if row is not None:
                yield row
        if pieces[-1]:
            self._keep(pieces[-1])

    def end(self) -> Row | None:
        """The last row if it has no trailing line break."""
        if not self._size:
            return None
        self._end_line()
        return self._row()

    def _keep(self, piece: bytes) -> None:
        self._size += len(piece)
        if self._size > LONGEST_ROW:
            self._lines.clear()
            self._parts.clear()
        else:
            self._parts.append(piece)

    def _end_line(self) -> None:
        line = b"".join(self._parts)
        self._parts.clear()
        if self._line == 1:
            line = line.removeprefix(_BOM)
        if self._quotes:
            if self._delimiter is None and line.strip():
                self._delimiter = _delimiter_of(line)
            if self._open or b'"' in line:
                cells = _CELLS[self._delimiter or _DELIMITERS[0]]
                self._open = cells.fullmatch(b'"' + line if self._open else line) is None
        self._lines.append(line)
        self._line += 1

    def _row(self) -> Row | None:
        content, size, line = b"".join(self._lines).strip(b"\r\n"), self._size, self._first
        self._lines.clear()
        self._size, self._open, self._first = 0, False, self._line
        if size > LONGEST_ROW:
            return Row(line, b"", _TOO_LONG + (": is a quotation mark not closed?" if self._quotes else ""))
        empty = _EMPTY_CELLS[self._delimiter].fullmatch(content) if self._delimiter else not content.strip()
        return None if empty else Row(line, content)


def _delimiter_of(line: bytes) -> bytes:
    """What separates the cells of a table with this first line: a comma, else a semicolon or a tab, as spreadsheets
    write where numbers have decimal commas."""
    return next((each for each in _DELIMITERS if each in line), _DELIMITERS[0])


def header_of(row: Row) -> tuple[tuple[str, ...], str]:
    """The column names in the first row of a CSV, and what separates them. Raises ValueError."""
    text, delimiter = row.content.decode(), _delimiter_of(row.content.partition(b"\n")[0]).decode()
    [record] = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True))
    return tuple(name.strip() for name in record), delimiter


class Receiver:
    """Stores rows as blocks of one batch, a few blocks per transaction, with memory bounded by these blocks.

    ``writing`` is shared by all batches of a service: a commit contains the blocks of one of them, so that the other
    writes of its group do not wait long.
    """

    def __init__(self, store: RunStore, number: int, writing: asyncio.Lock) -> None:
        self._store, self._number, self._writing = store, number, writing
        self._rows: list[Row] = []
        self._bytes = 0
        self._blocks: list[Block] = []
        self._packed = 0
        self._written = time.monotonic()
        self.total = 0

    async def add(self, rows: Sequence[Row]) -> None:
        """Append rows; may store full blocks."""
        for row in rows:
            self._rows.append(row)
            self._bytes += len(row.content)
            if len(self._rows) >= _BLOCK_ROWS or self._bytes >= _BLOCK_BYTES:
                await self._pack()
        self.total = self._packed + len(self._rows)
        if time.monotonic() - self._written > RECEIVING_S / 4:
            await self.finish()

    async def finish(self) -> None:
        """Store the remaining rows."""
        await self._pack()
        await self._write()
        self.total = self._packed

    async def _pack(self) -> None:
        rows, self._rows, self._bytes = self._rows, [], 0
        if not rows:
            return
        content = await aside(lambda: packed_rows(rows))
        self._blocks.append(Block(self._packed, len(rows), content))
        self._packed += len(rows)
        if len(self._blocks) >= _BLOCKS_PER_WRITE:
            await self._write()

    async def _write(self) -> None:
        blocks, self._blocks, self._written = tuple(self._blocks), [], time.monotonic()
        if not blocks:
            return
        async with self._writing:
            kept = await self._store.write(Receive(self._number, blocks))
        if not kept:
            raise Problem(408, "The batch took too long", "no row came for so long that the batch was given up")


async def in_slices(rows: Iterator[Row], count: int = 1000) -> AsyncIterator[list[Row]]:
    """Generated rows in slices of ``count``."""
    while found := await aside(lambda: list(islice(rows, count))):
        yield found
