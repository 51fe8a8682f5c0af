"""Display and input units: metric, or inches and psi. Stored and transmitted values are always metric."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum

from app.designs.units import OTHERS, figures, shown_as


class System(StrEnum):
    """Unit system of lengths and pressures."""

    METRIC = "metric"
    INCH = "inch"


SYSTEMS = {System.METRIC: "mm", System.INCH: "in"}
"""Labels of the unit systems in the selection."""

_INCH: dict[str, tuple[str, float]] = {
    "mm": ("in", 25.4),
    "µm": ("mil", 25.4),
    "mm²": ("in²", 645.16),
    "MPa": ("psi", 6.894757293168361e-3),
    "GPa": ("Msi", 6.894757293168361),
}
"""Displayed unit of a metric unit and its size in that metric unit. mil: 1e-3 in; Msi: 1e6 psi."""
_DIGITS = 12
"""Significant digits of a converted input, to absorb rounding: 0.5 in is 12.7 mm."""
_TABLE_DIGITS = 4
"""Significant digits of a criterion in a table."""


def system() -> System:
    """The current unit system."""
    return System.INCH if OTHERS.get() else System.METRIC


@contextmanager
def measuring(chosen: System) -> Iterator[None]:
    """Set the unit system within a context."""
    token = OTHERS.set(_INCH if chosen is System.INCH else {})
    try:
        yield
    finally:
        OTHERS.reset(token)


def unit_shown(unit: str) -> str:
    """The unit in which values of a metric unit are displayed."""
    return shown_as(unit)[0]


def told(value: float, unit: str) -> float:
    """Convert a metric value to its displayed unit."""
    size = shown_as(unit)[1]
    return value if size == 1.0 else value / size


def meant(value: float, unit: str) -> float:
    """Convert a displayed value to its metric unit; inverse of ``told``."""
    size = shown_as(unit)[1]
    return value if size == 1.0 else float(f"{value * size:.{_DIGITS}g}")


_NUMBER = r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
_IN_SENTENCE = re.compile(
    rf"(?:(?P<other>{_NUMBER})(?P<between> (?:and|и|і|…|< x <) ))?"
    rf"(?P<figure>{_NUMBER}) (?P<unit>{'|'.join(_INCH)})(?!\w)"
)
"""A figure with its unit, and one before it that shares the unit: "3 mm", "between 3 and 4 mm", "3 < x < 4 mm"."""


def in_sentence(text: str) -> str:
    """A sentence with its figures in the displayed units."""
    return _IN_SENTENCE.sub(_converted, text) if system() is System.INCH else text


def _converted(found: re.Match[str]) -> str:
    unit, other = found["unit"], found["other"]
    before = "" if other is None else f"{_figure(other, unit)}{found['between']}"
    return f"{before}{_figure(found['figure'], unit)} {unit_shown(unit)}"


def _figure(text: str, unit: str) -> str:
    """A metric figure in the displayed unit, with a digit more, so that rounding adds no error of its own, and at least
    as many as tables have."""
    digits = sum(each.isdigit() for each in text.partition("e")[0].lstrip("-0."))
    return figures(told(float(text), unit), max(digits + 1, _TABLE_DIGITS))
