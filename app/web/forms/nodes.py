"""The parts of a form. Each knows how to write its texts from a request, and its share of the request from texts.

Texts are what a browser sends: the name of an input → what stands in it; a box that is not ticked is not there.
``take`` reads an object of the request into texts, ``put`` writes texts into an object of the request.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from app.web.forms.numbers import number, shown

Texts = Mapping[str, str]
_NO_VALUE = object()
_FEW = 3


def applies(when: str, texts: Texts) -> bool:
    """Whether a condition as ``FormWords.when`` writes it is met."""
    if not when:
        return True
    return any(
        all(texts.get(name, "") in values.split(",") for name, _, values in (c.partition("=") for c in way.split("&")))
        for way in when.split("|")
    )


@dataclass(frozen=True, kw_only=True)
class Node:
    """What every part has: its key in the request's object, name of its input, JSON pointer, words, condition."""

    sort: ClassVar[str]
    key: str
    name: str
    pointer: str
    path: str
    label: str = ""
    help: str = ""
    when: str = ""
    toggled: bool = False
    """Whether it is added with a click; without it the request has null."""

    @property
    def hint(self) -> str:
        """What is said below it, if that is more than its label."""
        said = self.help.strip()
        return "" if said.lower() in self.label.lower() else said

    @property
    def box(self) -> str:
        """The name of the box that adds it."""
        return f"{self.name}.on"

    def present(self, texts: Texts) -> bool:
        return not self.toggled or texts.get(self.box) == "on"

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if not applies(self.when, texts):
            return
        value = self.value(texts) if self.present(texts) else None
        if value is not _NO_VALUE:
            into[self.key] = value

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        value = source.get(self.key, self.default)
        if self.toggled and value is not None:
            texts[self.box] = "on"
        self.show(value, texts)

    @property
    def default(self) -> Any:
        return None

    def value(self, texts: Texts) -> Any:
        raise NotImplementedError

    def show(self, value: Any, texts: dict[str, str]) -> None:
        raise NotImplementedError

    def parts(self, texts: Texts) -> Iterator[Node]:
        """Itself and all below that applies."""
        if applies(self.when, texts):
            yield self

    def names(self) -> Iterator[str]:
        """The names of all inputs."""
        yield self.name
        if self.toggled:
            yield self.box

    def fault(self, pointer: str, words: str) -> str:
        """What to say of a fault at or below its pointer."""
        return words


@dataclass(frozen=True, kw_only=True)
class Number(Node):
    sort: ClassVar[str] = "number"
    unit: str = ""
    allowed: str = ""
    nullable: bool = False
    whole: bool = False
    start: float | None = None
    slider: bool = False

    @property
    def hint(self) -> str:
        """The range, and what there is to say."""
        return "; ".join(part for part in (self.allowed, super().hint) if part)

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        text = texts.get(self.name, "").strip()
        if not text:
            # What is ticked must be filled in; what has a default falls back to it.
            return None if self.nullable and not self.toggled else _NO_VALUE
        found = number(text, self.unit)
        return int(found) if self.whole and isinstance(found, float) and found.is_integer() else found

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        super().put(into, texts)
        if self.toggled and self.present(texts) and applies(self.when, texts) and not texts.get(self.name, "").strip():
            into[self.key] = ""

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = shown(value)


@dataclass(frozen=True, kw_only=True)
class Text(Node):
    sort: ClassVar[str] = "text"
    most: int = 200

    def value(self, texts: Texts) -> Any:
        return texts.get(self.name, "")

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = value or ""


@dataclass(frozen=True, kw_only=True)
class Flag(Node):
    sort: ClassVar[str] = "flag"
    start: bool = False

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        return texts.get(self.name) == "on"

    def show(self, value: Any, texts: dict[str, str]) -> None:
        if value:
            texts[self.name] = "on"


@dataclass(frozen=True, kw_only=True)
class Choice(Node):
    """One of a list; ``values`` are what the request has for them. With ``runs`` the list is one of stored runs."""

    sort: ClassVar[str] = "choice"
    options: Mapping[str, str]
    values: Mapping[str, Any]
    start: Any = None
    runs: bool = False

    @property
    def few(self) -> bool:
        """Whether all options are shown at once."""
        return not self.runs and len(self.options) <= _FEW

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        text = texts.get(self.name, "")
        return self.values.get(text, text or None)

    def show(self, value: Any, texts: dict[str, str]) -> None:
        known = next((text for text, meant in self.values.items() if meant == value), None)
        texts[self.name] = shown(value) if known is None else known


@dataclass(frozen=True, kw_only=True)
class Switched(Choice):
    """A choice that the request does not name; others depend on it."""

    sort: ClassVar[str] = "union"
    of: Callable[[Mapping[str, Any]], str]

    @property
    def members(self) -> tuple[()]:
        return ()

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        pass

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        texts[self.name] = self.of(source)


@dataclass(frozen=True, kw_only=True)
class Several(Node):
    """Any of a list, each with its box."""

    sort: ClassVar[str] = "several"
    options: Mapping[str, str]
    start: tuple[str, ...] = ()

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        return [option for option in self.options if texts.get(f"{self.name}.{option}") == "on"]

    def show(self, value: Any, texts: dict[str, str]) -> None:
        for option in value or ():
            texts[f"{self.name}.{option}"] = "on"

    def names(self) -> Iterator[str]:
        for option in self.options:
            yield f"{self.name}.{option}"


@dataclass(frozen=True, kw_only=True)
class Effects(Node):
    """Which effects run: a rule for all, or for each one whether it must, must not, or follows its bound."""

    sort: ClassVar[str] = "effects"
    options: Mapping[str, str]
    known: Mapping[str, str]

    @property
    def default(self) -> Any:
        return "auto"

    def value(self, texts: Texts) -> Any:
        rule = texts.get(self.name, "auto")
        if rule != "choice":
            return rule
        chosen = {name: texts.get(f"{self.name}.{name}", "") for name in self.known}
        return {will: [name for name, said in chosen.items() if said == will] for will in ("include", "exclude")}

    def show(self, value: Any, texts: dict[str, str]) -> None:
        texts[self.name] = "choice" if isinstance(value, dict) else value
        if isinstance(value, dict):
            for will in ("include", "exclude"):
                texts.update({f"{self.name}.{name}": will for name in value.get(will, ())})

    def names(self) -> Iterator[str]:
        yield self.name
        for name in self.known:
            yield f"{self.name}.{name}"


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
        texts[self.name] = "; ".join(shown(item) for item in value or ())


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
        own = [f"{c.label}, {c.unit}" if c.unit else c.label for c in self.columns]
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
        lines: list[list[Any]] = []
        if self.shape == "columns":
            lines = self._lines(source)
        elif self.shape == "rows":
            lines = [[row.get(c.key) for c in self.columns] for row in source.get(self.key) or ()]
        else:
            for index, group in enumerate(source.get(self.key) or (), start=1):
                lines += [[index, *line] for line in self._lines(group)]
        texts[self.name] = "\n".join("\t".join(shown(cell) for cell in line) for line in lines)

    def _lines(self, source: Mapping[str, Any]) -> list[list[Any]]:
        lists = [source.get(c.key) or [] for c in self.columns]
        return [list(line) for line in zip(*lists, strict=False)]

    def fault(self, pointer: str, words: str) -> str:
        places = [part for part in pointer.split("/") if part.isdigit()]
        row = f"row {int(places[-1]) + 1}, " if places else ""
        if self.shape == "groups" and len(places) == 2:
            row = f"{self.first} {int(places[0]) + 1}, its point {int(places[1]) + 1}, "
        elif self.shape == "groups" and places:
            row = f"{self.first} {int(places[0]) + 1}, "
        column = next((c.label + ": " for c in self.columns if f"/{c.key}" in pointer), "")
        return row + column + words

    def show(self, value: Any, texts: dict[str, str]) -> None:
        raise NotImplementedError

    def value(self, texts: Texts) -> Any:
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Constant(Node):
    """What a member of a union says of itself."""

    sort: ClassVar[str] = "constant"
    constant: Any

    def value(self, texts: Texts) -> Any:
        return self.constant

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        pass

    def names(self) -> Iterator[str]:
        return iter(())


@dataclass(frozen=True, kw_only=True)
class Range(Node):
    """Least and greatest."""

    sort: ClassVar[str] = "range"
    low: Number
    high: Number
    start: tuple[float, ...] | None = None

    @property
    def hint(self) -> str:
        return "; ".join(part for part in (self.low.allowed, super().hint) if part)

    @property
    def default(self) -> Any:
        return self.start

    def value(self, texts: Texts) -> Any:
        ends = [end.value(texts) for end in (self.low, self.high)]
        return [None if end is _NO_VALUE else end for end in ends]

    def show(self, value: Any, texts: dict[str, str]) -> None:
        for end, part in zip((self.low, self.high), value or (None, None), strict=False):
            end.show(part, texts)

    def parts(self, texts: Texts) -> Iterator[Node]:
        if applies(self.when, texts):
            yield from (self, self.low, self.high)

    def names(self) -> Iterator[str]:
        yield from (self.low.name, self.high.name)
        if self.toggled:
            yield self.box


@dataclass(frozen=True, kw_only=True)
class Group(Node):
    """Fields of an object; with no key the fields are those of the object around it, and it is only a heading."""

    sort: ClassVar[str] = "group"
    children: tuple[Node, ...]
    closed: bool = False

    def value(self, texts: Texts) -> Any:
        inner: dict[str, Any] = {}
        for child in self.children:
            child.put(inner, texts)
        return inner

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if self.key:
            super().put(into, texts)
        elif applies(self.when, texts):
            for child in self.children:
                child.put(into, texts)

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        inner = source.get(self.key) if self.key else source
        if self.toggled and _filled(inner):
            texts[self.box] = "on"
        for child in self.children:
            child.take(inner if isinstance(inner, Mapping) else {}, texts)

    def parts(self, texts: Texts) -> Iterator[Node]:
        if applies(self.when, texts):
            yield self
            if self.present(texts):
                for child in self.children:
                    yield from child.parts(texts)

    def names(self) -> Iterator[str]:
        if self.toggled:
            yield self.box
        for child in self.children:
            yield from child.names()


def _filled(value: Any) -> bool:
    return any(item is not None for item in value.values()) if isinstance(value, Mapping) else value is not None


@dataclass(frozen=True)
class Member:
    """A member of a union: its tag, how it is told from a value, what it starts with, and its part of the form."""

    tag: str
    meant: Callable[[Any], bool]
    start: Any
    part: Node


@dataclass(frozen=True, kw_only=True)
class Union(Node):
    """A value of one of several forms; all of them are in the page, the one chosen is shown and counts.

    With no key the forms are those of the whole request.
    """

    sort: ClassVar[str] = "union"
    members: tuple[Member, ...]
    options: Mapping[str, str]

    def chosen(self, texts: Texts) -> Member:
        tag = texts.get(self.name)
        return next((member for member in self.members if member.tag == tag), self.members[0])

    def put(self, into: dict[str, Any], texts: Texts) -> None:
        if applies(self.when, texts):
            self.chosen(texts).part.put(into, texts)

    def take(self, source: Mapping[str, Any], texts: dict[str, str]) -> None:
        value = source.get(self.key) if self.key else source
        meant = next((member for member in self.members if member.meant(value)), self.members[0])
        texts[self.name] = meant.tag
        for member in self.members:
            given = value if member is meant else member.start
            member.part.take({self.key: given} if self.key else given or {}, texts)

    def parts(self, texts: Texts) -> Iterator[Node]:
        if applies(self.when, texts):
            yield self
            yield from self.chosen(texts).part.parts(texts)

    def names(self) -> Iterator[str]:
        yield self.name
        for member in self.members:
            yield from member.part.names()
