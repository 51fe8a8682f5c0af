"""API keys: creation, digest, and cached lookup."""

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
_CACHE_S = 2.0
"""Cache lifetime of lookups, and so the longest time a revoked key still works."""
_MAX_CACHED = 4096


def new_key(name: str, scopes: Iterable[Scope]) -> tuple[str, KeyRecord]:
    """Create a key; returns the secret, which is shown only once, and the record to store."""
    secret = PREFIX + secrets.token_urlsafe(_SECRET_BYTES)
    granted = " ".join(scope for scope in Scope if scope in set(scopes))
    return secret, KeyRecord(secrets.token_hex(4), digest_of(secret), name, granted, utc_now())


def digest_of(key: str) -> str:
    """SHA-256 of a key. With 256 random bits it cannot be guessed, so a fast unsalted hash protects it as well as a
    slow one."""
    return hashlib.sha256(key.encode()).hexdigest()


class KeyCache:
    """Looks up keys in the store, with a short cache."""

    def __init__(self, store: Callable[[], RunStore]) -> None:
        self._store = store
        self._known: OrderedDict[str, tuple[float, KeyRecord | None]] = OrderedDict()
        self._any: tuple[float, bool] = (0.0, False)

    async def find(self, digest: str) -> KeyRecord | None:
        """The valid key with this digest, or None."""
        due, found = self._known.get(digest, (0.0, None))
        if time.monotonic() >= due:
            found = await self._store().query(lambda connection: find_key(connection, digest))
            self._known[digest] = (time.monotonic() + _CACHE_S, found)
            self._known.move_to_end(digest)
            if len(self._known) > _MAX_CACHED:
                self._known.popitem(last=False)
        return found

    async def any(self) -> bool:
        """Whether any key exists; remembered once true."""
        due, found = self._any
        if not found and time.monotonic() >= due:
            found = await self._store().query(any_key)
            self._any = (time.monotonic() + _CACHE_S, found)
        return found


KeysRequired = Callable[[], Awaitable[bool]]
"""Whether requests currently need a key."""
