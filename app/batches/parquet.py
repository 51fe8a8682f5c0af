"""Rows of a Parquet file as requests: its columns are dotted fields."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import date
from decimal import Decimal
from pathlib import Path
from typing import IO, Any

from app.errors import Problem
from app.store.batch_inputs import Row
from app.store.hashing import canonical_json

_ROWS = 1000


class ParquetTable:
    """A Parquet file, read a few rows at a time. Raises Problem, also while it is read: 400 if it is none or damaged,
    501 without pyarrow."""

    def __init__(self, file: Path | IO[bytes]) -> None:
        try:
            import pyarrow.parquet
        except ImportError:
            detail = "this service was installed without the extra [parquet]; send NDJSON or CSV"
            raise Problem(501, "No Parquet here", detail) from None
        # Damage also appears as text that is no UTF-8 and as numbers too great for the type of their column.
        self._unreadable = (pyarrow.ArrowException, OSError, ValueError, OverflowError)
        try:
            self._file = pyarrow.parquet.ParquetFile(file)
            self.names = tuple(self._file.schema_arrow.names)
        except self._unreadable:
            raise _refusal("the body cannot be read as a Parquet file") from None

    def rows(self) -> Iterator[Row]:
        """The rows, numbered from 1."""
        for line, cells in enumerate(self._cells(), 1):
            yield Row(line, canonical_json([_carried(cell) for cell in cells]))

    def _cells(self) -> Iterator[tuple[Any, ...]]:
        try:
            for batch in self._file.iter_batches(batch_size=_ROWS):
                yield from zip(*(column.to_pylist() for column in batch.columns), strict=True)
        except self._unreadable:
            raise _refusal("the columns of the Parquet file cannot be read") from None


def _refusal(detail: str) -> Problem:
    return Problem(400, "No Parquet", detail)


def _carried(cell: Any) -> Any:
    """A cell as JSON. What JSON has not becomes text, as in a CSV, so that it is refused at its field if that needs
    something else; a decimal is a number."""
    if isinstance(cell, (list, tuple)):
        return [_carried(each) for each in cell]
    if isinstance(cell, dict):
        return {name: _carried(each) for name, each in cell.items()}
    if isinstance(cell, Decimal):
        cell = float(cell)
    if isinstance(cell, float):
        return cell if math.isfinite(cell) else str(cell)
    if isinstance(cell, date):
        return cell.isoformat()
    if isinstance(cell, bytes):
        return cell.decode(errors="replace")
    return cell if cell is None or isinstance(cell, (str, int)) else str(cell)
