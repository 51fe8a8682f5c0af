"""Keys: how they look, what of them is kept, and which are valid now."""

from __future__ import annotations

import hashlib
import secrets
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Iterable

from app.access.scopes import Scope
from app.store.keys import KeyRecord, any_key, find_key
from app.store.record import utc_now
from app.store.repository import RunStore

PREFIX = "cw_"
_SECRET_BYTES = 32
_FRESH_S = 2.0
"""So long an answer of the store about a key is believed: a revoked key works no longer than that."""
_REMEMBERED = 4096


def new_key(name: str, scopes: Iterable[Scope]) -> tuple[str, KeyRecord]:
    """A new key as its holder gets it, this once, and as it is kept."""
    shown = PREFIX + secrets.token_urlsafe(_SECRET_BYTES)
    told = " ".join(scope for scope in Scope if scope in set(scopes))
    return shown, KeyRecord(secrets.token_hex(4), digest_of(shown), name, told, utc_now())


def digest_of(key: str) -> str:
    """What is kept of a key. Its 256 random bits cannot be guessed, so a fast hash without salt hides them as well as
    a slow one."""
    return hashlib.sha256(key.encode()).hexdigest()


class KeyRing:
    """Looks keys up in the store, each at most every two seconds."""

    def __init__(self, store: Callable[[], RunStore]) -> None:
        self._store = store
        self._known: OrderedDict[str, tuple[float, KeyRecord | None]] = OrderedDict()
        self._any: tuple[float, bool] = (0.0, False)

    async def find(self, digest: str) -> KeyRecord | None:
        """The valid key with this digest, or None."""
        due, found = self._known.get(digest, (0.0, None))
        if time.monotonic() >= due:
            found = await self._store().query(lambda connection: find_key(connection, digest))
            self._known[digest] = (time.monotonic() + _FRESH_S, found)
            self._known.move_to_end(digest)
            if len(self._known) > _REMEMBERED:
                self._known.popitem(last=False)
        return found

    async def any(self) -> bool:
        """Whether there ever was a key; once there was, there always is."""
        due, found = self._any
        if not found and time.monotonic() >= due:
            found = await self._store().query(any_key)
            self._any = (time.monotonic() + _FRESH_S, found)
        return found


InForce = Callable[[], Awaitable[bool]]
"""Whether a key is asked for now."""
