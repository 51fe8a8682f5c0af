"""Parsing and formatting of numbers with decimal comma or point, grouped thousands and an optional unit suffix."""

from __future__ import annotations

import math
import re
from typing import Any

from app.designs.units import tidy
from app.words.languages import Language, language
from app.words.units import meant, told, unit_shown

UNITS: dict[str, dict[str, float]] = {
    "mm": {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "µm": 1e-3, "in": 25.4, '"': 25.4, "ft": 304.8},
    "µm": {"um": 1.0, "µm": 1.0, "mm": 1e3, "in": 25400.0, "mil": 25.4},
    "MPa": {"mpa": 1.0, "n/mm2": 1.0, "n/mm²": 1.0, "gpa": 1e3, "kpa": 1e-3, "pa": 1e-6, "bar": 0.1,
            "psi": 6.894757293168361e-3, "ksi": 6.894757293168361},
    "GPa": {"gpa": 1.0, "mpa": 1e-3, "n/mm2": 1e-3, "n/mm²": 1e-3, "psi": 6.894757293168361e-6,
            "ksi": 6.894757293168361e-3, "msi": 6.894757293168361},
    "N": {"n": 1.0, "kn": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665},
    "N·m": {"nm": 1.0, "n·m": 1.0, "n*m": 1.0, "lbf·ft": 1.3558179483314004, "lbf*ft": 1.3558179483314004},
    "kg": {"kg": 1.0, "g": 1e-3, "lb": 0.45359237, "oz": 0.028349523125},
    "kg/m³": {"kg/m3": 1.0, "kg/m³": 1.0, "g/cm3": 1e3, "g/cm³": 1e3},
    "Hz": {"hz": 1.0, "1/s": 1.0, "s⁻¹": 1.0, "rpm": 1.0 / 60.0, "1/min": 1.0 / 60.0, "/min": 1.0 / 60.0,
           "min⁻¹": 1.0 / 60.0},
    "rad": {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "°": {"deg": 1.0, "°": 1.0, "rad": 180.0 / math.pi},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "ft/s": 0.3048, "km/h": 1.0 / 3.6},
    "cm³": {"cm3": 1.0, "cm³": 1.0, "l": 1e3, "ml": 1.0, "cc": 1.0, "in3": 16.387064, "in³": 16.387064},
    "s": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "J": {"j": 1.0, "kj": 1e3},
    "W": {"w": 1.0, "kw": 1e3},
}  # fmt: skip

_CYRILLIC = {
    "мкм": "µm", "мм": "mm", "см": "cm", "м": "m", "па": "pa", "кпа": "kpa", "мпа": "mpa", "гпа": "gpa", "бар": "bar",
    "н": "n", "кн": "kn", "г": "g", "кг": "kg", "гц": "hz", "об": "1", "с": "s", "мс": "ms", "мин": "min", "хв": "min",
    "рад": "rad", "град": "deg", "мл": "ml", "л": "l", "дж": "j", "кдж": "kj", "вт": "w", "квт": "kw",
}  # fmt: skip
"""Units as Russian and Ukrainian write them; "об/мин" is 1/min."""

_MAX_DIGITS = 16
_GROUPS = re.compile(r"^[+-]?\d{1,3}(?:[\s'’]\d{3})+(?!\d)")
_NUMBER = re.compile(r"([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(\S.*)?")


def others(unit: str) -> str:
    """Other units that a field accepts, as displayed text."""
    known = {unit: 1.0, **{name: size for name, size in UNITS.get(unit, {}).items() if size != 1.0}}
    here = unit_shown(unit).lower()
    found = [name for name in known if name not in ("um", '"', "msi") and name.lower() != here]
    return ", ".join(found) if len(known) > 1 else ""


def number(text: str, unit: str = "") -> float | str:
    """The number in ``unit``; the text itself if it is not a finite number with a known unit, or if its comma may
    separate thousands."""
    typed = text.strip().replace("\u2212", "-").replace("–", "-")
    if _may_be_thousands(typed):
        return text
    typed = _GROUPS.sub(lambda found: re.sub(r"[\s'’]", "", found[0]), typed)
    matched = _NUMBER.fullmatch(typed)
    if matched is None:
        return text
    digits, behind = matched.groups()
    value = float(digits.replace(",", "."))
    if behind is None:
        return meant(value, unit) if math.isfinite(value) else text
    size = 1.0 if behind == unit else UNITS.get(unit, {}).get(_latin(behind.strip().lower()))
    if size is None:
        return text
    value = value if size == 1.0 else value * size
    return value if math.isfinite(value) else text


def _latin(unit: str) -> str:
    """A unit in lower case with Latin letters and the micro sign, which looks like the Greek letter."""
    return re.sub("[а-яі]+", lambda word: _CYRILLIC.get(word[0], word[0]), unit).replace("\u03bc", "µ")


def _may_be_thousands(typed: str) -> bool:
    """Whether an English reader could mean thousands by the comma: 7,850."""
    return language() == Language.EN and re.match(r"[+-]?[1-9]\d{0,2},\d{3}(?!\d)", typed) is not None


def shown(value: Any, unit: str = "") -> str:
    """A request value as text: exact in its own unit, to 12 significant digits in another."""
    if value is None:
        return ""
    if unit_shown(unit) != unit and isinstance(value, (int, float)):
        # The fewest digits that convert back to the same value.
        texts = (f"{told(value, unit):.{digits}g}" for digits in range(3, _MAX_DIGITS))
        return next((text for text in texts if meant(float(text), unit) == value), repr(told(value, unit)))
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else tidy(repr(value))
    return str(value)
