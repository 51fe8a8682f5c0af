"""Names of fields as people read them, in the page's language."""

from __future__ import annotations

from app.designs.units import split_unit
from app.words.languages import gettext


def named(name: str) -> tuple[str, str]:
    """A field's name as words and its unit: ``crank_radius_mm`` → (crank radius, mm)."""
    words, unit = split_unit(name)
    sign = "± " if words.startswith("± ") else ""
    return sign + gettext(words.removeprefix("± ")), unit


def plain(name: object) -> str:
    """A name of the contract as words of the language spoken."""
    return gettext(str(name).replace("_", " ").replace("-", " "))
