"""What a report consists of: plain text, tables, pictures and formulas. How it looks is the writers'."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from app.designs.calculation.printed import Printed


class Standing(StrEnum):
    """How a verdict is shown."""

    HOLDS = "holds"
    DOUBTFUL = "doubtful"
    FAILS = "fails"
    PLAIN = "plain"
    """There is no verdict: an analysis."""


@dataclass(frozen=True)
class Banner:
    """The verdict: the sentence that somebody reads who reads no more."""

    standing: Standing
    word: str
    text: str


@dataclass(frozen=True)
class Paragraph:
    text: str


@dataclass(frozen=True)
class Bullets:
    items: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """Rows of text under a head; ``numeric`` columns are set to the right, ``widths`` are shares of the line.

    ``marked`` rows stand out.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: frozenset[int] = frozenset()
    widths: tuple[int, ...] = ()
    marked: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Facts:
    """Names and values side by side, in groups with a title."""

    groups: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]


@dataclass(frozen=True)
class Figure:
    """A picture as SVG with what it shows; ``wide`` ones have the whole line."""

    svg: str
    caption: str
    wide: bool = True


@dataclass(frozen=True)
class Figures:
    """Pictures two in a line."""

    figures: tuple[Figure, ...]


@dataclass(frozen=True)
class Part:
    """The begin of a part of the calculation."""

    text: str


@dataclass(frozen=True)
class Given:
    """A symbol with its number, and what it is."""

    symbol: str
    number: Printed
    unit: str
    words: str


@dataclass(frozen=True)
class Givens:
    items: tuple[Given, ...]


@dataclass(frozen=True)
class Formula:
    """A formula, the numbers put in, and the result; ``again``: the formula itself was shown before.

    ``source`` is the number of its source in the list; ``told`` what the run says of the quantity.
    """

    symbol: str
    formula: str
    numbers: Mapping[str, Printed]
    result: Printed
    unit: str
    words: str
    source: str = ""
    told: str = ""
    again: bool = False


@dataclass(frozen=True)
class Rows:
    """Numbers under (symbol, unit), a row for each place; ``first`` is the number of the first row."""

    head: tuple[tuple[str, str], ...]
    rows: tuple[tuple[Printed, ...], ...]
    first: int


Block = Banner | Paragraph | Bullets | Table | Facts | Figure | Figures | Part | Givens | Formula | Rows


@dataclass(frozen=True)
class Section:
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Report:
    """A report; ``title`` is the user's own, ``subtitle`` what was done, ``about`` what identifies the run.

    ``request`` is the run's request as JSON, which solves the same again. ``language`` is the code of its texts'.
    """

    title: str
    subtitle: str
    about: tuple[tuple[str, str], ...]
    opening: tuple[Block, ...]
    sections: tuple[Section, ...]
    request: str
    language: str = "en"
