"""The language that is spoken: English, Russian or Ukrainian.

Texts are in English where they are written; gettext catalogues under ``locale`` have the others. What the JSON API says
stays English. `scripts.messages` gathers the texts and writes the catalogues.
"""

from __future__ import annotations

import gettext as standard
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import StrEnum
from pathlib import Path

LOCALE = Path(__file__).parent / "locale"
DOMAIN = "crankwright"


class Language(StrEnum):
    """Codes of the languages."""

    EN = "en"
    RU = "ru"
    UK = "uk"


LANGUAGES = {Language.EN: "English", Language.RU: "Русский", Language.UK: "Українська"}
"""What the languages call themselves."""
ENGLISH = standard.NullTranslations()
_CATALOGUES = {
    "en": ENGLISH,
    **{code: standard.translation(DOMAIN, LOCALE, [code], fallback=True) for code in LANGUAGES if code != "en"},
}
_chosen: ContextVar[tuple[str, standard.NullTranslations]] = ContextVar("language", default=("en", ENGLISH))


def language() -> str:
    """The code of the language spoken just now."""
    return _chosen.get()[0]


def catalogue() -> standard.NullTranslations:
    """The texts of the language spoken just now."""
    return _chosen.get()[1]


def gettext(message: str) -> str:
    """A text in the language spoken just now; itself where the catalogue has none."""
    return catalogue().gettext(message) if message else ""


def ngettext(one: str, many: str, count: int) -> str:
    """A text that goes with a number."""
    return catalogue().ngettext(one, many, count)


@contextmanager
def speaking(code: str, texts: standard.NullTranslations | None = None) -> Iterator[None]:
    """Speak a language for a while; with ``texts`` from another catalogue than its own."""
    token = _chosen.set((code, texts or _CATALOGUES[code]))
    try:
        yield
    finally:
        _chosen.reset(token)
