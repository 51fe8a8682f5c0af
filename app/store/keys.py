"""API keys and the audit log: records, writes and queries."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from datetime import datetime
from typing import Any, TypeVar

from sqlalchemy import Connection, RowMapping, Table, insert, select, update

from app.store.errors import UnknownKey
from app.store.hashing import row_hash
from app.store.models import api_keys, audit
from app.store.record import new_run_id, utc_now
from app.store.rows import check


@dataclass(frozen=True)
class KeyRecord:
    """A stored key: the digest of its secret, never the secret. ``scopes`` are separated by spaces."""

    id: str
    digest: str
    name: str
    scopes: str
    created_at: datetime
    revoked_at: datetime | None = None


@dataclass(frozen=True)
class AuditRecord:
    """An entry of the audit log: who did what to which subject, and when."""

    id: str
    at: datetime
    actor: str
    action: str
    subject: str


T = TypeVar("T", KeyRecord, AuditRecord)


@dataclass(frozen=True)
class WriteAudit:
    """Append an entry to the audit log."""

    actor: str
    action: str
    subject: str

    def __call__(self, connection: Connection) -> None:
        record = AuditRecord(new_run_id(), utc_now(), self.actor[:200], self.action, self.subject[:200])
        connection.execute(insert(audit), _row(audit.name, asdict(record)))


@dataclass(frozen=True)
class CreateKey:
    """Store a new key."""

    record: KeyRecord
    actor: str

    def __call__(self, connection: Connection) -> None:
        connection.execute(insert(api_keys), _row(api_keys.name, asdict(self.record)))
        WriteAudit(self.actor, "key.create", f"{self.record.id} {self.record.scopes}")(connection)


@dataclass(frozen=True)
class RevokeKey:
    """Revoke a key; it stays listed. Returns False if it was revoked before. Raises UnknownKey."""

    id: str
    actor: str

    def __call__(self, connection: Connection) -> bool:
        row = connection.execute(select(api_keys).where(api_keys.c.id == self.id)).mappings().first()
        if row is None:
            raise UnknownKey(self.id)
        record = _record(KeyRecord, api_keys, row)
        if record.revoked_at is not None:
            return False
        revoked = asdict(replace(record, revoked_at=utc_now()))
        connection.execute(update(api_keys).where(api_keys.c.id == self.id).values(_row(api_keys.name, revoked)))
        WriteAudit(self.actor, "key.revoke", self.id)(connection)
        return True


def find_key(connection: Connection, digest: str) -> KeyRecord | None:
    """The key with this digest, unless it is revoked."""
    row = connection.execute(select(api_keys).where(api_keys.c.digest == digest)).mappings().first()
    found = None if row is None else _record(KeyRecord, api_keys, row)
    return found if found is not None and found.revoked_at is None else None


def list_keys(connection: Connection) -> list[KeyRecord]:
    """All keys, revoked ones included, oldest first."""
    query = select(api_keys).order_by(api_keys.c.created_at, api_keys.c.id)
    return [_record(KeyRecord, api_keys, row) for row in connection.execute(query).mappings().all()]


def any_key(connection: Connection) -> bool:
    """Whether any key exists, revoked ones included."""
    return connection.execute(select(api_keys.c.id).limit(1)).first() is not None


def read_audit(connection: Connection, limit: int) -> list[AuditRecord]:
    """The ``limit`` newest entries of the audit log, newest first. Raises DamagedRecord."""
    rows = connection.execute(select(audit).order_by(audit.c.id.desc()).limit(limit)).mappings().all()
    return [_record(AuditRecord, audit, row) for row in rows]


def _record(kind: type[T], table: Table, row: RowMapping) -> T:
    """The record in a row. Raises DamagedRecord."""
    check(table.name, "id", row)
    return kind(**{field.name: row[field.name] for field in fields(kind)})  # type: ignore[arg-type]


def _row(table: str, values: dict[str, Any]) -> dict[str, Any]:
    return {**values, "row_hash": row_hash(table, values)}
