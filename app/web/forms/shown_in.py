"""Units and language in which a form was shown to whoever filled it in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from app.words.languages import LANGUAGES, language, speaking
from app.words.units import SYSTEMS, System, measuring, system

NAME = "shown_in."
"""Start of the hidden input's name, which ends with the units; its value is the language."""


@contextmanager
def as_shown(texts: dict[str, str]) -> Iterator[None]:
    """Units and language of a sent form, whose input for them is taken out of ``texts``.

    They may have been switched since, in another tab: the figures are still meant as the labels beside them said.
    """
    units, spoken = system(), language()
    for name in [name for name in texts if name.startswith(NAME)]:
        told, units_told = texts.pop(name), name.removeprefix(NAME)
        units = System(units_told) if units_told in SYSTEMS else units
        spoken = told if told in LANGUAGES else spoken
    with measuring(units), speaking(spoken):
        yield
