"""Browser sessions, kept in memory: a restart ends them."""

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
_MAX_SESSIONS = 10_000


@dataclass(frozen=True)
class Session:
    """``key_digest`` identifies the key, which is looked up on every request; ``csrf`` must be sent with every form;
    ``ends`` is when the session expires, on the monotonic clock."""

    key_digest: str
    ends: float
    csrf: str = field(default_factory=lambda: secrets.token_urlsafe(32))

    def is_own(self, token: str | None) -> bool:
        """Whether a form's token is this session's, in constant time."""
        return token is not None and hmac.compare_digest(token.encode(), self.csrf.encode())


session: ContextVar[Session | None] = ContextVar("session", default=None)
"""The session of the current request."""


class Sessions:
    """Sessions by the digest of their cookie, each valid for ``life_s``; the oldest is dropped at the limit."""

    def __init__(self, life_s: float) -> None:
        self.life_s = life_s
        self._open: OrderedDict[str, Session] = OrderedDict()

    def begin(self, key_digest: str) -> tuple[str, Session]:
        """Create a session; returns the cookie's value, too."""
        token = secrets.token_urlsafe(32)
        begun = self._open[digest_of(token)] = Session(key_digest, time.monotonic() + self.life_s)
        if len(self._open) > _MAX_SESSIONS:
            self._open.popitem(last=False)
        return token, begun

    def find(self, token: str | None) -> Session | None:
        """The session of a cookie, unless it has expired."""
        found = self._open.get(digest_of(token)) if token else None
        return found if found is not None and time.monotonic() < found.ends else None

    def end(self, token: str | None) -> None:
        if token:
            self._open.pop(digest_of(token), None)


def token_of(cookies: bytes | None) -> str | None:
    """The session cookie's value in a Cookie header."""
    try:
        found = SimpleCookie((cookies or b"").decode("latin-1")).get(COOKIE)
    except CookieError:
        return None
    return found.value if found else None
