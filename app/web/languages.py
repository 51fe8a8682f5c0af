"""The language of a page: English, Russian or Ukrainian, from a cookie or what the browser asks for.

Texts are in English where they are written; gettext catalogues under ``locale`` have the others. What the JSON API says
stays English. `scripts.messages` gathers the texts and writes the catalogues.
"""

from __future__ import annotations

import gettext as standard
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from http.cookies import CookieError, SimpleCookie
from pathlib import Path

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

LOCALE = Path(__file__).parent / "locale"
DOMAIN = "crankwright"
COOKIE = "language"
LANGUAGES = {"en": "English", "ru": "Русский", "uk": "Українська"}
"""Codes, and what the languages call themselves."""
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


def preferred(headers: Headers) -> str:
    """The language of the cookie, else the first that the browser asks for and that there is, else English."""
    try:
        kept = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        kept = None
    if kept is not None and kept.value in LANGUAGES:
        return kept.value
    asked = [_weighed(part) for part in headers.get("accept-language", "").split(",")[:20]]
    known = [(weight, code) for weight, code in asked if code in LANGUAGES and weight > 0.0]
    return max(known, key=lambda pair: pair[0])[1] if known else "en"


def _weighed(part: str) -> tuple[float, str]:
    """A language of Accept-Language with its weight; 0 where that is no number."""
    tag, _, weight = part.partition(";")
    try:
        return float(weight.strip().removeprefix("q=") or 1.0), tag.strip().partition("-")[0].lower()
    except ValueError:
        return 0.0, ""


class Speaking:
    """Every request is answered in the language of who asks."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        with speaking(preferred(Headers(scope=scope))):
            await self._app(scope, receive, send)
