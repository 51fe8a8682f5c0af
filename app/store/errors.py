"""Errors of the store, one type per HTTP problem."""

from __future__ import annotations

from pathlib import Path


class StoreError(Exception):
    """Base of all store errors."""


class InvalidDatabaseUrl(StoreError):
    """The URL names no database that can be used. The URL itself is not shown: it may contain a password."""

    def __init__(self, url: str, reason: str = "which is no database URL") -> None:
        began = url.partition(":")[0]
        allowed = "sqlite:///path/to/file or postgresql://user@host/name"
        super().__init__(
            f"CRANKWRIGHT_DATABASE_URL or --database-url begins with {began!r}, {reason}: allowed is {allowed}"
        )


class MissingDatabase(StoreError):
    """The file of an SQLite database does not exist."""

    def __init__(self, file: Path) -> None:
        super().__init__(f"there is no database at {file}")


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


class StoreClosed(StoreError):
    """The store is shutting down and accepts no more writes."""


class UnknownKey(StoreError):
    """No key has this id."""

    def __init__(self, key_id: str) -> None:
        super().__init__(f"no key has the id {key_id!r}")


class DamagedRecord(StoreError):
    """A row does not match its hash. Its content must not be shown."""

    def __init__(self, table: str, key: str) -> None:
        super().__init__(f"the record {key} of {table} is damaged")
        self.table, self.key = table, key
