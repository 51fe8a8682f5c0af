"""Names of fields as people read them, in the page's language."""

from __future__ import annotations

from app.designs.units import UNITS, split_unit
from app.web.languages import gettext

__all__ = ["UNITS", "named", "split_unit"]


def named(name: str) -> tuple[str, str]:
    """A field's name as words and its unit: ``crank_radius_mm`` → (crank radius, mm)."""
    words, unit = split_unit(name)
    return gettext(words), unit
