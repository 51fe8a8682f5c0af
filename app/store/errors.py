"""What the store refuses, as types that the edge can turn into problem details."""

from __future__ import annotations


class StoreError(Exception):
    """Base of everything the store raises on its own account."""


class IdempotencyConflict(StoreError):
    """The idempotency key was used before with another request."""

    def __init__(self, key: str) -> None:
        super().__init__("the idempotency key was used before with another request")
        self.key = key


class InvalidCursor(StoreError):
    """A paging cursor that this store never issued."""


class UnknownRun(StoreError):
    """No run has this id."""

    def __init__(self, run_id: str) -> None:
        super().__init__(f"no run has the id {run_id!r}")
        self.run_id = run_id


class UnknownBatch(StoreError):
    """No batch has this id."""

    def __init__(self, batch_id: str) -> None:
        super().__init__(f"no batch has the id {batch_id!r}")
        self.batch_id = batch_id


class StoreFull(StoreError):
    """The disk has no room; nothing of the write was kept, everything before it is."""


class StoreBusy(StoreError):
    """Another process held the database for longer than a write waits; nothing of the write was kept."""


class StoreClosed(StoreError):
    """The store is shutting down and takes no more writes."""
