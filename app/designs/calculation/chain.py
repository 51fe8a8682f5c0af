"""A chain of calculation steps: given values, then formulas evaluated with the printed numbers of earlier steps.

Each result follows from the numbers as printed, so a pocket calculator reproduces its digits. If the run reports the
same quantity, its value is shown for comparison.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from app.designs.calculation.expression import calculated, names_in
from app.designs.calculation.printed import INPUT_DIGITS, RESULT_DIGITS, NotANumber, Printed, printed

DEGREE = "°"
_SUBSCRIPTS = re.compile(r"(?<=[A-Za-z])_\w+")


@dataclass(frozen=True)
class Title:
    """A section heading."""

    text: str


@dataclass(frozen=True)
class Remark:
    text: str


@dataclass(frozen=True)
class Given:
    """An input; ``source`` says where it comes from, if not from the request."""

    symbol: str
    words: str
    number: Printed
    unit: str
    source: str = ""


@dataclass(frozen=True)
class Step:
    """A formula.

    ``reported`` is the run's value of the quantity in the step's unit; ``again`` marks a formula shown before with
    other subscripts.
    """

    symbol: str
    formula: str
    words: str
    numbers: Mapping[str, Printed]
    result: Printed
    unit: str
    source: str
    reported: float | None = None
    again: bool = False

    @property
    def ratio(self) -> float | None:
        """Ratio of the run's value to the hand calculation."""
        return None if self.reported is None or self.result.shown == 0.0 else self.reported / self.result.shown


@dataclass(frozen=True)
class Column:
    """A column of a table; without a formula, an input."""

    symbol: str
    words: str
    unit: str = ""
    formula: str = ""


@dataclass(frozen=True)
class Tabulated:
    """Formulas evaluated at several points, one row each.

    ``first``: number of the first row, used as subscript in later steps. ``fixed``: values shared by all rows.
    ``fresh``: symbols whose formulas were not shown before.
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Printed, ...], ...]
    first: int
    fixed: Mapping[str, Printed]
    fresh: frozenset[str]

    def numbers(self, row: int) -> dict[str, Printed]:
        """All values available to the formulas of a row."""
        own = zip((column.symbol for column in self.columns), self.rows[row], strict=True)
        return {**self.fixed, **dict(own)}


def _shape(symbol: str, formula: str) -> str:
    """The formula without subscripts."""
    return _SUBSCRIPTS.sub("", f"{symbol} = {formula}")


Item = Title | Remark | Given | Step | Tabulated


class _Values(dict[str, float]):
    """Numerical values of printed numbers."""

    def __init__(self, known: Mapping[str, Printed]) -> None:
        super().__init__({name: number.value for name, number in known.items()})


@dataclass
class Chain:
    """Builder of a calculation; symbols are looked up by name, angles are in radians."""

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
        self, symbol: str, words: str, value: float, unit: str = "", source: str = "", digits: int = INPUT_DIGITS
    ) -> float:
        """Add an input, an angle (unit °) in radians; returns the printed value."""
        number = printed(value, digits, unit == DEGREE)
        self.items.append(Given(symbol, words, number, unit, source))
        self._know(symbol, number)
        return number.value

    def _know(self, symbol: str, number: Printed) -> None:
        """Define a symbol; each has only one meaning in a chain."""
        if symbol in self.known:
            raise ValueError(f"{symbol} is already defined")
        self.known[symbol] = number

    def step(
        self,
        symbol: str,
        formula: str,
        words: str,
        unit: str = "",
        source: str = "",
        reported: float | None = None,
        digits: int = RESULT_DIGITS,
    ) -> float:
        """Add a formula of known symbols; returns the printed value. Raises NotANumber."""
        numbers = {name: self.known[name] for name in names_in(formula)}
        value = calculated(formula, _Values(numbers))
        number = printed(value, digits, unit == DEGREE)
        shape = _shape(symbol, formula)
        self.items.append(Step(symbol, formula, words, numbers, number, unit, source, reported, shape in self._shown))
        self._shown.add(shape)
        self._know(symbol, number)
        return number.value

    def table(self, columns: Sequence[Column], given: Sequence[Sequence[float]], first: int = 0) -> None:
        """Add a table with a row per entry of ``given``, the values of the columns without a formula.

        Defines symbols with the row number as subscript, such as f_3. Raises NotANumber.
        """
        rows = []
        for number, values in enumerate(given, first):
            left, row = list(values), dict[str, Printed]()
            for column in columns:
                known = {**self.known, **row}
                value = calculated(column.formula, _Values(known)) if column.formula else left.pop(0)
                row[column.symbol] = printed(value, RESULT_DIGITS, column.unit == DEGREE)
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
        """All distinct sources in order of use."""
        found = [item.source for item in self.items if isinstance(item, Step) and item.source]
        return list(dict.fromkeys(found))


__all__ = ["DEGREE", "Chain", "Column", "Given", "Item", "NotANumber", "Remark", "Step", "Tabulated", "Title"]
