"""A chain of steps: what is given, then every formula with the printed numbers of the steps before it.

Each result is calculated from the numbers as they are printed, so that whoever follows it with a pocket calculator
finds the same digits. Where the run tells the same quantity, its figure stands beside the step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.designs.calculation.expression import calculated, names_in
from app.designs.calculation.printed import FOUND, GIVEN, NotANumber, Printed, printed

DEGREE = "°"


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
    """One formula. ``told`` is what the run itself says of the quantity, in the step's unit."""

    symbol: str
    formula: str
    words: str
    numbers: Mapping[str, Printed]
    result: Printed
    unit: str
    source: str
    told: float | None = None

    @property
    def ratio(self) -> float | None:
        """The run's figure over the one by hand."""
        return None if self.told is None or self.result.shown == 0.0 else self.told / self.result.shown


Item = Title | Remark | Given | Step


@dataclass
class Chain:
    """A calculation as it is built up; symbols are looked up by name, angles in radians."""

    items: list[Item] = field(default_factory=list)
    known: dict[str, Printed] = field(default_factory=dict)

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
        self.known[symbol] = number
        return number.value

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
        value = calculated(formula, {name: number.value for name, number in numbers.items()})
        number = printed(value, digits, unit == DEGREE)
        self.items.append(Step(symbol, formula, words, numbers, number, unit, source, told))
        self.known[symbol] = number
        return number.value

    @property
    def steps(self) -> list[Step]:
        return [item for item in self.items if isinstance(item, Step)]

    @property
    def sources(self) -> list[str]:
        """Every source once, in the order in which they are called upon."""
        found = [item.source for item in self.items if isinstance(item, Step | Given) and item.source]
        return list(dict.fromkeys(found))


__all__ = ["DEGREE", "Chain", "Given", "Item", "NotANumber", "Remark", "Step", "Title"]
