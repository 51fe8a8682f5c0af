"""Language and unit system of a request, from cookies or, for the language, the Accept-Language header."""

from __future__ import annotations

from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from app.access import scopes
from app.access.caller import caller
from app.access.sessions import session
from app.edge.asgi import header
from app.words.languages import LANGUAGES, speaking
from app.words.units import SYSTEMS, System, measuring

COOKIE, UNITS_COOKIE = "language", "units"
_COOKIE_MAX_AGE_S = 365 * 24 * 3600


def preferred(headers: Headers) -> str:
    """The language of the cookie, else the supported one of highest weight in Accept-Language, else English."""
    kept = _cookie_value(headers, COOKIE)
    if kept in LANGUAGES:
        return kept
    given = headers.get("accept-language")
    asked = [_weighed(part) for part in given.split(",")[:20]] if given else []
    known = [(weight, code) for weight, code in asked if code in LANGUAGES and weight > 0.0]
    return max(known, key=lambda pair: pair[0])[1] if known else "en"


def units_of(headers: Headers) -> System:
    """The unit system of the cookie, else metric."""
    kept = _cookie_value(headers, UNITS_COOKIE)
    return System(kept) if kept in SYSTEMS else System.METRIC


def keep(answer: Response, cookie: str, value: str) -> None:
    """Make the browser remember a language or a unit system."""
    answer.set_cookie(cookie, value, max_age=_COOKIE_MAX_AGE_S, httponly=True, samesite="lax")


def if_allowed(address: str, scope: scopes.Scope) -> str:
    """The address to which a page's form is sent to show it in another language or other units with what was typed;
    empty if the user's key does not allow the form to be sent."""
    return address if session.get() is None or scope in caller.get().scopes else ""


def _cookie_value(headers: Headers, cookie: str) -> str:
    given = headers.get("cookie")
    if given is None:
        return ""
    try:
        kept = SimpleCookie(given).get(cookie)
    except CookieError:
        return ""
    return kept.value if kept is not None else ""


def _weighed(part: str) -> tuple[float, str]:
    """Weight and language of an Accept-Language entry; weight 0 if malformed."""
    tag, _, weight = part.partition(";")
    try:
        return float(weight.strip().removeprefix("q=") or 1.0), tag.strip().partition("-")[0].lower()
    except ValueError:
        return 0.0, ""


class Speaking:
    """ASGI middleware that sets the language and the unit system of each request."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        if header(scope, b"cookie") is None and header(scope, b"accept-language") is None:
            await self._app(scope, receive, send)  # as from most API clients: the defaults hold
            return
        headers = Headers(scope=scope)
        with speaking(preferred(headers)), measuring(units_of(headers)):
            await self._app(scope, receive, send)
