"""The language of who asks: from a cookie, else what the browser wants."""

from __future__ import annotations

from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from app.words.languages import LANGUAGES, speaking

COOKIE = "language"


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
