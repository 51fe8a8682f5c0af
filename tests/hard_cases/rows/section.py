"""What a wing tells the page: sections of cases, and how a case becomes a row."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mpmath as mp
import numpy as np

EPS = 2.0**-52
GOAL = 30.0
"""Every error is to stay below GOAL eps max(1, kappa)."""

NO_TEXTBOOK = "none"


@dataclass(frozen=True)
class Measured:
    """One value of a case: its error in eps max(1, kappa), and kappa."""

    units: float
    condition: float


@dataclass(frozen=True)
class Row:
    """A case with the greatest of its values' figures; ``measured`` is empty where only a refusal is judged."""

    case: Mapping
    measured: tuple[Measured, ...]
    textbook: str

    def cells(self) -> tuple[str, ...]:
        """As the page shows them."""
        told = (self.case["name"], self.case["why"])
        if not self.measured:
            return (*told, "refused", "0", "0", self.textbook)
        plain = max(one.units * max(1.0, one.condition) for one in self.measured)
        shown = (max(one.condition for one in self.measured), plain, max(one.units for one in self.measured))
        return (*told, *(f"{value:.2g}" for value in shown), self.textbook)


@dataclass(frozen=True)
class Section:
    """A part of the page: ``row`` is made of one case at a time, so that a test need not make them all."""

    title: str
    introduction: str
    cases: Sequence[Mapping]
    row: Callable[[Mapping], Row]


def relative(found: float, reference: Mapping) -> float:
    """The plain relative error of a textbook's value."""
    if not np.isfinite(found):
        return float("inf")
    with mp.workdps(40):
        exact = mp.mpf(reference["value"])
        return float(abs(mp.mpf(float(found)) - exact) / abs(exact)) if exact else float(abs(found))


def figure(value: float) -> str:
    """A textbook's relative error as the page shows it."""
    return f"{value:.2g}" if np.isfinite(value) else "not finite"
