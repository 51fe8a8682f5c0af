"""Field names as words and units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from contextvars import ContextVar
from functools import cache
from typing import Any

from pydantic import BaseModel

MICRO, MILLI, MEGA, GIGA = 1e-6, 1e-3, 1e6, 1e9

UNITS = {
    "_m_s2": ("m/s²", 1.0), "_n_m2": ("N/m²", 1.0), "_kg_m3": ("kg/m³", 1.0), "_kg_m2": ("kg·m²", 1.0),
    "_n_m": ("N/m", 1.0), "_mm2": ("mm²", MILLI**2), "_cm3": ("cm³", MICRO), "_nm": ("N·m", 1.0), "_m_s": ("m/s", 1.0),
    "_nmm": ("N·mm", MILLI), "_mpa": ("MPa", MEGA), "_gpa": ("GPa", GIGA), "_rad": ("rad", 1.0),
    "_deg": ("°", math.radians(1.0)), "_hz": ("Hz", 1.0), "_kg": ("kg", 1.0), "_mm": ("mm", MILLI),
    "_um": ("µm", MICRO), "_g": ("g", MILLI), "_n": ("N", 1.0), "_w": ("W", 1.0), "_j": ("J", 1.0), "_s": ("s", 1.0),
}  # fmt: skip
"""Endings of field names, each with its unit as displayed and in SI."""

OTHERS: ContextVar[Mapping[str, tuple[str, float]]] = ContextVar("units", default={})  # noqa: B039 (never changed)
"""Units that are shown instead of metric ones, each with its size in the metric one; none unless in inches."""


def shown_as(unit: str) -> tuple[str, float]:
    """The unit in which values of a metric unit are shown, and its size in that."""
    return OTHERS.get().get(unit, (unit, 1.0))


_EXPONENT = re.compile(r"e(?:\+|(-))0*(?=\d)")


def figures(value: float, digits: int = 4) -> str:
    """Format with ``digits`` significant digits, without an exponent below 1e7."""
    # Rounding may carry: 9.7 to one digit has two.
    return f"{value:.0f}" if 10.0**digits - 0.5 <= abs(value) < 1e7 else tidy(f"{value:.{digits}g}")


def with_unit(text: str, unit: str) -> str:
    """A figure and its unit; only the sign of degrees follows without a space."""
    return text + unit if unit == "°" else f"{text} {unit}".rstrip()


def quantity(value: float, unit: str, digits: int = 6) -> str:
    """A metric value in the unit shown, with that."""
    shown, size = shown_as(unit)
    return with_unit(figures(value / size, digits), shown)


def power(value: float, digits: int = 0) -> str:
    """Format as a power of ten with ``digits`` decimals: 1e-6."""
    return tidy(f"{value:.{digits}e}")


def tidy(text: str) -> str:
    """The exponents in a text without plus sign and leading zeros: 1e-06 → 1e-6, 2e+07 → 2e7."""
    return _EXPONENT.sub(r"e\1", text) if "e" in text else text


def split_unit(name: str) -> tuple[str, str]:
    """A field's name as words and its unit: ``crank_radius_mm`` → (crank radius, mm).

    A result's standard uncertainty, ``rod_mass_kg_u``, has the words and the unit of its result: (± rod mass, kg).
    """
    if name.endswith("_u"):
        words, unit = split_unit(name.removesuffix("_u"))
        return f"± {words}", unit
    ending = _ending(name)
    return name.removesuffix(ending).replace("_", " "), UNITS[ending][0] if ending else ""


def in_si(name: str) -> tuple[str, float]:
    """A field's name without its unit, as the solvers have it, and that unit in SI: (crank_radius, 1e-3)."""
    ending = _ending(name)
    return name.removesuffix(ending), UNITS[ending][1] if ending else 1.0


def by_solver_name(*names: str) -> dict[str, str]:
    """Field names by the names of the same quantities in the solvers."""
    return {in_si(name)[0]: name for name in names}


def _ending(name: str) -> str:
    return next((ending for ending in UNITS if name.endswith(ending) and len(name) > len(ending)), "")


def si(model: BaseModel) -> dict[str, Any]:
    """The fields of a model that are not null, under the solver's names and in SI units."""
    values, found = vars(model), {}
    for field, name, unit in _in_si(type(model)):
        value = values[field]
        if value is not None:
            found[name] = value if unit == 1.0 else _times(value, unit)
    return found


def _times(value: Any, unit: float) -> Any:
    return tuple(each * unit for each in value) if isinstance(value, list) else value * unit


@cache
def _in_si(model: type[BaseModel]) -> list[tuple[str, str, float]]:
    """Each field of a model, its name in the solvers, and its unit."""
    return [(field, *in_si(field)) for field in model.model_fields]
