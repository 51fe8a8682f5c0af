"""Lists of numbers, and rows of them, as lines of text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from app.web.forms.nodes import Node, Texts, applies
from app.web.forms.numbers import number, shown
from app.words.languages import gettext as _
from app.words.units import unit_shown


@dataclass(frozen=True, kw_only=True)
class Numbers(Node):
    """A short list of numbers in one line."""

    sort: ClassVar[str] = "numbers"
    unit: str = ""
    nullable: bool = False

    def value(self, texts: Texts) -> Any:
        cells = cells_of(texts.get(self.name, ""))
        return [number(cell, self.unit) for cell in cells] if cells or not self.nullable else None

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = "; ".join(shown(item, self.unit) for item in value or ())


def cells_of(line: str, columns: int = 0) -> list[str]:
    """The cells of a line: between tabs, semicolons or spaces; between commas where nothing else parts them."""
    line = line.strip()
    cells = [cell.strip() for cell in re.split(r"[\t;]|\s+", line) if cell.strip(" ,")]
    cells = [cell.rstrip(",") for cell in cells]
    commas = line.count(",")
    if len(cells) == 1 and commas and (columns == commas + 1 or not columns):
        return [cell.strip() for cell in line.split(",") if cell.strip()]
    return cells


@dataclass(frozen=True)
class Column:
    """A column of a table: its key in the request, heading, unit."""

    key: str
    label: str
    unit: str


@dataclass(frozen=True, kw_only=True)
class Table(Node):
    """Rows of numbers as one text, a line for each row: what a spreadsheet puts on the clipboard.

    ``shape`` tells how the request holds them: "columns", lists beside each other in the object itself; "rows", a
    list of objects; "groups", a list of objects of columns, the number of the object (from 1) in the first column.
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
        return [cells_of(line, wide) for line in texts.get(self.name, "").splitlines() if line.strip()]

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if not applies(self.when, texts):
            return
        rows = self.rows(texts)
        if self.shape == "columns":
            into.update(self._by_column(rows))
        elif self.shape == "rows":
            into[self.key] = [
                {c.key: number(cell, c.unit) for c, cell in zip(self.columns, row, strict=False)} for row in rows
            ]
        else:
            groups: dict[str, list[list[str]]] = {}
            for row in rows:
                groups.setdefault(row[0], []).append(row[1:])
            into[self.key] = [self._by_column(group) for group in groups.values()]

    def _by_column(self, rows: list[list[str]]) -> dict[str, list[float | str]]:
        return {c.key: [number(row[i], c.unit) for row in rows if i < len(row)] for i, c in enumerate(self.columns)}

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

    def fault(self, pointer: str, words: str) -> str:
        places = [part for part in pointer.split("/") if part.isdigit()]
        row = _("row %(row)s") % {"row": int(places[-1]) + 1} + ", " if places else ""
        if self.shape == "groups" and len(places) == 2:
            row = f"{self.first} {int(places[0]) + 1}, " + _("its point %(row)s") % {"row": int(places[1]) + 1} + ", "
        elif self.shape == "groups" and places:
            row = f"{self.first} {int(places[0]) + 1}, "
        column = next((c.label + ": " for c in self.columns if f"/{c.key}" in pointer), "")
        return row + column + words

    def show(self, value: Any, texts: dict[str, str]) -> None:
        raise NotImplementedError

    def value(self, texts: Texts) -> Any:
        raise NotImplementedError
