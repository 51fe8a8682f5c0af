"""Field names as words and units."""

from __future__ import annotations

import re

UNITS = {
    "_m_s2": "m/s²", "_n_m2": "N/m²", "_kg_m3": "kg/m³", "_kg_m2": "kg·m²", "_n_m": "N/m", "_mm2": "mm²", "_cm3": "cm³",
    "_nm": "N·m",
    "_m_s": "m/s", "_nmm": "N·mm", "_mpa": "MPa", "_gpa": "GPa", "_rad": "rad", "_deg": "°", "_hz": "Hz",
    "_kg": "kg", "_mm": "mm", "_um": "µm", "_g": "g", "_n": "N", "_w": "W", "_j": "J", "_s": "s",
}  # fmt: skip


_EXPONENT = re.compile(r"e(?:\+|(-))0*(?=\d)")


def figures(value: float, digits: int = 4) -> str:
    """Format with ``digits`` significant digits, without an exponent below 1e7."""
    # Rounding may carry: 9.7 to one digit has two.
    return f"{value:.0f}" if 10.0**digits - 0.5 <= abs(value) < 1e7 else tidy(f"{value:.{digits}g}")


def with_unit(text: str, unit: str) -> str:
    """A figure and its unit; only the sign of degrees follows without a space."""
    return text + unit if unit == "°" else f"{text} {unit}".rstrip()


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
    for ending, unit in UNITS.items():
        if name.endswith(ending) and len(name) > len(ending):
            return name.removesuffix(ending).replace("_", " "), unit
    return name.replace("_", " "), ""
