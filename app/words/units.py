"""The units in which people read and type figures: metric, or inches and psi. What is stored and sent is metric."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import StrEnum

from app.designs.units import figures


class System(StrEnum):
    """What lengths and pressures are told in."""

    METRIC = "metric"
    INCH = "inch"


SYSTEMS = {System.METRIC: "mm", System.INCH: "in"}
"""What they are called where one is chosen."""

_INCH: dict[str, tuple[str, float]] = {
    "mm": ("in", 25.4),
    "µm": ("mil", 25.4),
    "mm²": ("in²", 645.16),
    "MPa": ("psi", 6.894757293168361e-3),
    "GPa": ("Msi", 6.894757293168361),
}
"""For a metric unit the one it is told in, and that one's size. mil: a thousandth of an inch; Msi: a million psi."""
_DIGITS = 12
"""Significant digits of what was typed in one unit and is meant in another: 0.5 in is 12.7 mm."""
_chosen: ContextVar[System] = ContextVar("units", default=System.METRIC)


def system() -> System:
    """The units in use just now."""
    return _chosen.get()


@contextmanager
def measuring(chosen: System) -> Iterator[None]:
    """Use these units for a while."""
    token = _chosen.set(chosen)
    try:
        yield
    finally:
        _chosen.reset(token)


def unit_shown(unit: str) -> str:
    """The unit in which figures of a metric unit are told."""
    return _INCH[unit][0] if system() is System.INCH and unit in _INCH else unit


def told(value: float, unit: str) -> float:
    """A figure of a metric unit in the unit it is told in."""
    size = _size(unit)
    return value if size == 1.0 else value / size


def meant(value: float, unit: str) -> float:
    """The metric figure of one that was told."""
    size = _size(unit)
    return value if size == 1.0 else float(f"{value * size:.{_DIGITS}g}")


def _size(unit: str) -> float:
    return _INCH[unit][1] if system() is System.INCH and unit in _INCH else 1.0


def quantity(value: float, unit: str, digits: int = 6) -> str:
    """A figure of a metric unit as it is told, with its unit."""
    return f"{figures(told(value, unit), digits)} {unit_shown(unit)}".rstrip()
