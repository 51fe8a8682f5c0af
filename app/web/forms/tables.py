"""Number lists and tables entered as lines of text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from app.web.forms.nodes import Node, Texts, applies
from app.web.forms.numbers import number, shown
from app.words.languages import Language, language
from app.words.languages import gettext as _
from app.words.units import unit_shown

_GAP = re.compile(r'\s+(?![^\W\d]|[°"])')
"""White space between numbers, not before a unit."""


@dataclass(frozen=True, kw_only=True)
class Numbers(Node):
    """A short list of numbers on one line."""

    sort: ClassVar[str] = "numbers"
    unit: str = ""
    nullable: bool = False

    def value(self, texts: Texts) -> Any:
        cells = [cell for cell in cells_of(texts.get(self.name, "")) if cell]
        return [number(cell, self.unit) for cell in cells] if cells or not self.nullable else None

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = "; ".join(shown(item, self.unit) for item in value or ())


def cells_of(line: str, columns: int = 0) -> list[str]:
    """Split a line at tabs or semicolons, else at spaces; at commas only if there is no other separator.

    Cells between two separators, or before the first or behind the last one, may be empty. A single comma is a decimal
    one where the language writes it so and no number of columns says otherwise; units stay with their numbers.
    """
    if re.search(r"[\t;]", line):
        return [cell.strip() for cell in re.split(r"[\t;]", line)]
    cells = [cell.rstrip(",") for cell in _GAP.split(line.strip()) if cell.strip(" ,")]
    commas = line.count(",")
    listed = columns == commas + 1 if columns else commas > 1 or language() == Language.EN
    return [cell.strip() for cell in line.split(",")] if len(cells) == 1 and commas and listed else cells


def _without_end(cells: list[str], columns: int) -> list[str]:
    """The cells without empty ones behind the last column."""
    while len(cells) > columns and not cells[-1]:
        cells = cells[:-1]
    return cells


def _fitted(cells: list[str], columns: int) -> list[str]:
    """The cells of a row; those behind the last column stay with its cell, which is no number then."""
    return [*cells[: columns - 1], "; ".join(cells[columns - 1 :])] if len(cells) > columns else cells


@dataclass(frozen=True)
class Column:
    """A table column: request key, heading, unit."""

    key: str
    label: str
    unit: str


@dataclass(frozen=True, kw_only=True)
class Table(Node):
    """A table of numbers as text, one line per row, compatible with spreadsheet clipboards.

    ``shape`` is its layout in the request: "columns", parallel lists in the object itself; "rows", a list of objects;
    "groups", a list of objects of columns, with the object's number (from 1) in the first column.
    """

    sort: ClassVar[str] = "table"
    columns: tuple[Column, ...]
    shape: str
    first: str = ""

    @property
    def headings(self) -> list[str]:
        own = [f"{c.label}, {unit_shown(c.unit)}" if c.unit else c.label for c in self.columns]
        return [self.first, *own] if self.shape == "groups" else own

    def rows(self, texts: Texts) -> list[list[str]]:
        wide = len(self.headings)
        rows = [_without_end(cells_of(line, wide), wide) for line in texts.get(self.name, "").splitlines()]
        return [row for row in rows if any(row)]

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if not applies(self.when, texts):
            return
        rows = [_fitted(row, len(self.headings)) for row in self.rows(texts)]
        if self.shape == "columns":
            into.update(self._by_column(rows))
        elif self.shape == "rows":
            into[self.key] = [
                {c.key: number(cell, c.unit) for c, cell in zip(self.columns, row, strict=False) if cell}
                for row in rows
            ]
        elif self._without_group(rows):
            into[self.key] = None
        else:
            groups: dict[str, list[list[str]]] = {}
            for row in rows:
                groups.setdefault(row[0], []).append(row[1:])
            into[self.key] = [self._by_column(group) for group in groups.values()]

    def _by_column(self, rows: list[list[str]]) -> dict[str, list[float | str]]:
        filled = [row + [""] * (len(self.columns) - len(row)) for row in rows]
        return {c.key: [number(row[i], c.unit) for row in filled] for i, c in enumerate(self.columns)}

    def _without_group(self, rows: list[list[str]]) -> list[int]:
        """The rows, from 1, that do not say which group they belong to."""
        return [place for place, row in enumerate(rows, start=1) if not row[0]] if self.shape == "groups" else []

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        lines: list[list[str]] = []
        if self.shape == "columns":
            lines = self._lines(source)
        elif self.shape == "rows":
            lines = [[shown(row.get(c.key), c.unit) for c in self.columns] for row in source.get(self.key) or ()]
        else:
            for index, group in enumerate(source.get(self.key) or (), start=1):
                lines += [[str(index), *line] for line in self._lines(group)]
        texts[self.name] = "\n".join("\t".join(line) for line in lines)

    def _lines(self, source: Mapping[str, Any]) -> list[list[str]]:
        lists = [[shown(cell, c.unit) for cell in source.get(c.key) or ()] for c in self.columns]
        return [list(line) for line in zip(*lists, strict=False)]

    def fault(self, pointer: str, words: str, texts: Texts) -> str:
        rows = self.rows(texts)
        for place, row in enumerate(rows, start=1):
            if len(row) > len(self.headings):
                values = {"row": place, "found": len(row), "expected": len(self.headings)}
                return _("row %(row)s has %(found)s values; %(expected)s are expected") % values
        if alone := self._without_group(rows):
            return _("row %(row)s") % {"row": alone[0]} + f", {self.first}: " + _("is missing")
        indices = [part for part in pointer.split("/") if part.isdigit()]
        row = _("row %(row)s") % {"row": int(indices[-1]) + 1} + ", " if indices else ""
        if self.shape == "groups" and len(indices) == 2:
            row = f"{self.first} {int(indices[0]) + 1}, " + _("its point %(row)s") % {"row": int(indices[1]) + 1} + ", "
        elif self.shape == "groups" and indices:
            row = f"{self.first} {int(indices[0]) + 1}, "
        column = next((c.label + ": " for c in self.columns if f"/{c.key}" in pointer), "")
        return row + column + words

    def show(self, value: Any, texts: dict[str, str]) -> None:
        raise NotImplementedError

    def value(self, texts: Texts) -> Any:
        raise NotImplementedError
