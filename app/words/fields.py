"""Translated labels of fields."""

from __future__ import annotations

from typing import Any

from app.designs.form import COMMON, look_up
from app.designs.kind import Kind
from app.designs.units import split_unit
from app.words.english import in_english
from app.words.languages import gettext, language


def named(name: str) -> tuple[str, str]:
    """Label and unit of a field name: ``crank_radius_mm`` → (crank radius, mm)."""
    words, unit = split_unit(name)
    sign = "± " if words.startswith("± ") else ""
    words = words.removeprefix("± ")
    return sign + (in_english(words) if language() == "en" else gettext(words)), unit


def named_in(path: str) -> tuple[str, str]:
    """Label and unit of a result by its dotted path; a part of a quantity is named with it:
    ``contact_pressures_mpa.small_end`` → (small end (contact pressures), MPa)."""
    group, _, own = path.rpartition(".")
    words, unit = named(own)
    whole, unit_of_all = named(group.rpartition(".")[2])
    return (f"{words} ({whole})", unit_of_all) if unit_of_all and not unit else (words, unit)


def plain(name: object) -> str:
    """An identifier of the contract as translated text."""
    return gettext(str(name).replace("_", " ").replace("-", " "))


def choice(kind: Kind, name: str, value: Any) -> str | None:
    """The translated label of a choice, as in the kind's form; None if the field or its value has none."""
    label = (look_up(kind.form.options, COMMON.options, name) or {}).get(str(value))
    return gettext(label) if label else None
