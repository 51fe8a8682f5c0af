"""A service that others can reach is not open by accident."""

from __future__ import annotations

from app.settings import Settings
from app.store.errors import StoreError
from app.store.keys import list_keys
from app.store.repository import RunStore


class Unprotected(StoreError):
    """The service would be open to whoever reaches it."""


def check_protected(settings: Settings, store: RunStore) -> None:
    """Raises Unprotected where others reach the service and there is neither a key nor the word that none is wanted."""
    if settings.is_local or settings.open:
        return
    if not any(key.revoked_at is None for key in store.read(list_keys)):
        raise Unprotected(
            f"bound to {settings.host}, others can reach this service: make a key with 'crankwright keys create', "
            "or set CRANKWRIGHT_OPEN=1 to serve everybody"
        )
