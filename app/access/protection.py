"""Refusal to start a reachable service without access control by accident."""

from __future__ import annotations

from app.settings import Settings
from app.store.errors import StoreError
from app.store.keys import list_keys
from app.store.repository import RunStore


class UnprotectedService(StoreError):
    """The service would be reachable without access control."""


def check_protected(settings: Settings, store: RunStore) -> None:
    """Raise UnprotectedService if other machines can reach the service and there is neither a key nor
    CRANKWRIGHT_OPEN."""
    if settings.is_local or settings.open:
        return
    if not any(key.revoked_at is None for key in store.read(list_keys)):
        raise UnprotectedService(
            f"bound to {settings.host}, other machines can reach this service: create a key with "
            "'crankwright keys create', or set CRANKWRIGHT_OPEN=1 to serve without keys"
        )
