"""Current language: English, Russian or Ukrainian.

Source texts are English; gettext catalogues under ``locale`` hold the translations. The JSON API stays in English.
``scripts.messages`` extracts the texts and writes the catalogues.
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
    """Language codes (ISO 639-1)."""

    EN = "en"
    RU = "ru"
    UK = "uk"


LANGUAGES = {Language.EN: "English", Language.RU: "Русский", Language.UK: "Українська"}
"""Native names of the languages."""
ENGLISH = standard.NullTranslations()
_CATALOGUES = {
    "en": ENGLISH,
    **{code: standard.translation(DOMAIN, LOCALE, [code], fallback=True) for code in LANGUAGES if code != "en"},
}
_current: ContextVar[tuple[str, standard.NullTranslations]] = ContextVar("language", default=("en", ENGLISH))


def language() -> str:
    """The code of the current language."""
    return _current.get()[0]


def catalogue() -> standard.NullTranslations:
    """The catalogue of the current language."""
    return _current.get()[1]


def gettext(message: str) -> str:
    """Translate a message; returned unchanged if the catalogue lacks it."""
    return catalogue().gettext(message) if message else ""


def ngettext(one: str, many: str, count: int) -> str:
    """Translate a message with plural forms."""
    return catalogue().ngettext(one, many, count)


@contextmanager
def speaking(code: str, texts: standard.NullTranslations | None = None) -> Iterator[None]:
    """Set the language within a context; ``texts`` overrides its catalogue."""
    token = _current.set((code, texts or _CATALOGUES[code]))
    try:
        yield
    finally:
        _current.reset(token)
