"""Format-independent content of a report: text, tables, figures and formulas. Layout is left to the writers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from app.designs.calculation.chain import Given
from app.designs.calculation.printed import Printed


class Standing(StrEnum):
    """Status of a verdict, as displayed."""

    HOLDS = "holds"
    DOUBTFUL = "doubtful"
    FAILS = "fails"
    PLAIN = "plain"
    """No verdict (an analysis)."""


@dataclass(frozen=True)
class Banner:
    """The verdict with its summary sentence."""

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
    """Rows of text under a head. ``numeric`` columns are right-aligned, ``widths`` are relative column widths and
    ``marked`` rows are highlighted."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: frozenset[int] = frozenset()
    widths: tuple[int, ...] = ()
    marked: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Facts:
    """Name-value pairs in titled groups."""

    groups: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]


@dataclass(frozen=True)
class Figure:
    """An SVG figure with caption; ``wide`` spans the full line."""

    svg: str
    caption: str
    wide: bool = True


@dataclass(frozen=True)
class Figures:
    """Figures in two columns."""

    figures: tuple[Figure, ...]


@dataclass(frozen=True)
class Part:
    """Heading of a part of the calculation."""

    text: str


@dataclass(frozen=True)
class Givens:
    """Given quantities, their words in the report's language."""

    items: tuple[Given, ...]


@dataclass(frozen=True)
class Formula:
    """A formula with substituted numbers and result; ``again``: the formula was shown before, so only numbers follow.

    ``source`` is its reference number in the list of sources; ``told`` the run's value of the quantity.
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
    """Table of numbers with (symbol, unit) heads, one row per station; ``first`` is the number of the first row."""

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
    """A report: ``title`` given by the user, ``subtitle`` with kind and mode, ``about`` with the run's identification.

    ``request`` is the run's request as JSON, which reproduces the run. ``language`` is the language code of the texts.
    """

    title: str
    subtitle: str
    about: tuple[tuple[str, str], ...]
    opening: tuple[Block, ...]
    sections: tuple[Section, ...]
    request: str
    language: str = "en"
