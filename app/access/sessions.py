"""Who has logged in with a key in a browser: kept in memory, so a restart ends every session."""

from __future__ import annotations

import hmac
import secrets
import time
from collections import OrderedDict
from contextvars import ContextVar
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie

from app.access.keys import digest_of

COOKIE = "crankwright_session"
_MOST = 10_000


@dataclass(frozen=True)
class Session:
    """``key_digest`` finds the key again with each request; ``csrf`` must come back with each form; it lasts until
    ``ends`` on the monotonic clock."""

    key_digest: str
    ends: float
    csrf: str = field(default_factory=lambda: secrets.token_urlsafe(32))

    def is_own(self, token: str | None) -> bool:
        """Whether a form's token is this session's."""
        return token is not None and hmac.compare_digest(token.encode(), self.csrf.encode())


session: ContextVar[Session | None] = ContextVar("session", default=None)
"""The session of the request under way."""


class Sessions:
    """Sessions by the digest of their cookie, each ``life_s`` long; the oldest goes when there are too many."""

    def __init__(self, life_s: float) -> None:
        self.life_s = life_s
        self._open: OrderedDict[str, Session] = OrderedDict()

    def begin(self, key_digest: str) -> tuple[str, Session]:
        """A new session, and the cookie's value."""
        token = secrets.token_urlsafe(32)
        begun = self._open[digest_of(token)] = Session(key_digest, time.monotonic() + self.life_s)
        if len(self._open) > _MOST:
            self._open.popitem(last=False)
        return token, begun

    def find(self, token: str | None) -> Session | None:
        """The session of a cookie, if it has not ended."""
        found = self._open.get(digest_of(token)) if token else None
        return found if found is not None and time.monotonic() < found.ends else None

    def end(self, token: str | None) -> None:
        if token:
            self._open.pop(digest_of(token), None)


def token_of(cookies: bytes | None) -> str | None:
    """The session's cookie in a Cookie header."""
    try:
        found = SimpleCookie((cookies or b"").decode("latin-1")).get(COOKIE)
    except CookieError:
        return None
    return found.value if found else None
