"""A chain of steps: what is given, then every formula with the printed numbers of the steps before it.

Each result is calculated from the numbers as they are printed, so that whoever follows it with a pocket calculator
finds the same digits. Where the run tells the same quantity, its figure stands beside the step.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from app.designs.calculation.expression import calculated, names_in
from app.designs.calculation.printed import FOUND, GIVEN, NotANumber, Printed, printed

DEGREE = "°"
_BELOW = re.compile(r"(?<=[A-Za-z])_\w+")


@dataclass(frozen=True)
class Title:
    """The begin of a part of the calculation."""

    text: str


@dataclass(frozen=True)
class Remark:
    text: str


@dataclass(frozen=True)
class Given:
    """A number that the calculation begins with; ``source`` says where it comes from if not from the request."""

    symbol: str
    words: str
    number: Printed
    unit: str
    source: str = ""


@dataclass(frozen=True)
class Step:
    """One formula. ``told`` is what the run itself says of the quantity, in the step's unit; ``again`` is true where
    the same formula was shown before, with other things below its symbols."""

    symbol: str
    formula: str
    words: str
    numbers: Mapping[str, Printed]
    result: Printed
    unit: str
    source: str
    told: float | None = None
    again: bool = False

    @property
    def ratio(self) -> float | None:
        """The run's figure over the one by hand."""
        return None if self.told is None or self.result.shown == 0.0 else self.told / self.result.shown


@dataclass(frozen=True)
class Column:
    """One quantity of a table; one without a formula is given."""

    symbol: str
    words: str
    unit: str = ""
    formula: str = ""


@dataclass(frozen=True)
class Tabulated:
    """The same formulas at several places, a row for each; ``first`` is the number of the first row, which stands below
    the symbols wherever a later step takes one from the table. ``fixed`` are the numbers that all rows share, ``fresh``
    the symbols whose formulas were not shown before."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Printed, ...], ...]
    first: int
    fixed: Mapping[str, Printed]
    fresh: frozenset[str]

    def numbers(self, row: int) -> dict[str, Printed]:
        """All that the formulas of a row are calculated with."""
        own = zip((column.symbol for column in self.columns), self.rows[row], strict=True)
        return {**self.fixed, **dict(own)}


def _shape(symbol: str, formula: str) -> str:
    """The formula without what stands below its symbols."""
    return _BELOW.sub("", f"{symbol} = {formula}")


Item = Title | Remark | Given | Step | Tabulated


class _Values(dict[str, float]):
    """The values of printed numbers."""

    def __init__(self, known: Mapping[str, Printed]) -> None:
        super().__init__({name: number.value for name, number in known.items()})


@dataclass
class Chain:
    """A calculation as it is built up; symbols are looked up by name, angles in radians."""

    items: list[Item] = field(default_factory=list)
    known: dict[str, Printed] = field(default_factory=dict)
    _shown: set[str] = field(default_factory=set)

    def __getitem__(self, symbol: str) -> float:
        return self.known[symbol].value

    def title(self, text: str) -> None:
        self.items.append(Title(text))

    def remark(self, text: str) -> None:
        self.items.append(Remark(text))

    def given(
        self, symbol: str, words: str, value: float, unit: str = "", source: str = "", digits: int = GIVEN
    ) -> float:
        """A number to begin with, an angle (unit °) in radians; the value as it is printed."""
        number = printed(value, digits, unit == DEGREE)
        self.items.append(Given(symbol, words, number, unit, source))
        self._know(symbol, number)
        return number.value

    def _know(self, symbol: str, number: Printed) -> None:
        """A symbol has one meaning in a chain."""
        if symbol in self.known:
            raise ValueError(f"{symbol} is known already")
        self.known[symbol] = number

    def step(
        self,
        symbol: str,
        formula: str,
        words: str,
        unit: str = "",
        source: str = "",
        told: float | None = None,
        digits: int = FOUND,
    ) -> float:
        """A formula over symbols known so far; the value as it is printed. Raises NotANumber where there is none."""
        numbers = {name: self.known[name] for name in names_in(formula)}
        value = calculated(formula, _Values(numbers))
        number = printed(value, digits, unit == DEGREE)
        shape = _shape(symbol, formula)
        self.items.append(Step(symbol, formula, words, numbers, number, unit, source, told, shape in self._shown))
        self._shown.add(shape)
        self._know(symbol, number)
        return number.value

    def table(self, columns: Sequence[Column], given: Sequence[Sequence[float]], first: int = 0) -> None:
        """A row for each of the ``given``, whose values are those of the columns without a formula, in their order.

        Symbols with a row's number below, such as f_3, are known from then on. Raises NotANumber.
        """
        rows = []
        for number, values in enumerate(given, first):
            left, row = list(values), dict[str, Printed]()
            for column in columns:
                known = {**self.known, **row}
                value = calculated(column.formula, _Values(known)) if column.formula else left.pop(0)
                row[column.symbol] = printed(value, FOUND, column.unit == DEGREE)
            for symbol, value in row.items():
                self._know(f"{symbol}_{number}", value)
            rows.append(tuple(row.values()))
        own = {column.symbol for column in columns}
        names = [name for column in columns if column.formula for name in names_in(column.formula)]
        fixed = {name: self.known[name] for name in names if name not in own}
        shapes = {column.symbol: _shape(column.symbol, column.formula) for column in columns if column.formula}
        fresh = frozenset(symbol for symbol, shape in shapes.items() if shape not in self._shown)
        self._shown.update(shapes.values())
        self.items.append(Tabulated(tuple(columns), tuple(rows), first, fixed, fresh))

    @property
    def steps(self) -> list[Step]:
        return [item for item in self.items if isinstance(item, Step)]

    @property
    def sources(self) -> list[str]:
        """Every source once, in the order in which they are called upon."""
        found = [item.source for item in self.items if isinstance(item, Step) and item.source]
        return list(dict.fromkeys(found))


__all__ = ["DEGREE", "Chain", "Column", "Given", "Item", "NotANumber", "Remark", "Step", "Tabulated", "Title"]
