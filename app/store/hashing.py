"""SHA-256 over specs, requests and stored rows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from pydantic_core import to_json

_CANONICAL = json.JSONEncoder(
    sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False, check_circular=False
)


def canonical_json(value: Any) -> bytes:
    """Canonical JSON: sorted keys, no spaces, shortest floats, UTF-8. Raises ValueError for NaN and infinity."""
    return _CANONICAL.encode(value).encode()


def spec_hash(kind: str, mode: str, spec: bytes) -> str:
    """Hash of a request's meaning: kind, mode and validated spec without the name.

    Requests that differ only in formatting, key order or name have the same hash.
    """
    content = json.loads(spec)
    if isinstance(content, dict):
        return canonical_spec(kind, mode, content)[1]
    return hashlib.sha256(canonical_json([kind, mode, content])).hexdigest()


def canonical_spec(kind: str, mode: str, content: Mapping[str, Any]) -> tuple[bytes, str]:
    """JSON of a validated spec, the name first and all else canonical, and its ``spec_hash``.

    Each field is encoded only once, since specs with long tables take milliseconds; the Python encoder, whose numbers
    older hashes were made of, is asked only once, since it is prepared anew each time.
    """
    meaning = canonical_json({field: value for field, value in content.items() if field != "name"})
    hashed = b"%s,%s]" % (to_json([kind, mode])[:-1], meaning)
    parts = [b'"name":%s' % to_json(content["name"])] if "name" in content else []
    if len(meaning) > len(b"{}"):
        parts.append(meaning[1:-1])
    return b"{%s}" % b",".join(parts), hashlib.sha256(hashed).hexdigest()


def request_hash(method: str, path: str, body: bytes) -> str:
    """Hash of a request as sent, byte for byte, to detect a different request under the same idempotency key."""
    digest = hashlib.sha256()
    for part in (method.encode(), path.encode(), body):
        digest.update(len(part).to_bytes(8, "big"))
        digest.update(part)
    return digest.hexdigest()


def row_hash(table: str, columns: Mapping[str, Any]) -> str:
    """Hash of all columns of a row.

    Each non-NULL column enters with its name, type and length-prefixed content, in order of the names: bytes cannot
    move between columns unnoticed, and a nullable column added later leaves old hashes valid.
    """
    parts = [b"row-1:", table.encode()]
    for name, value in sorted(columns.items()):
        if value is None or name == "row_hash":
            continue
        # The most frequent types are told here: this runs for every column of every run.
        if isinstance(value, bytes):
            tag, content = "bytes", value
        elif isinstance(value, str):
            tag, content = "text", value.encode("utf-8", "surrogateescape")
        else:
            tag, content = _encode(value)
        parts += f"\n{name}:{tag}:{len(content)}:".encode(), content
    return hashlib.sha256(b"".join(parts)).hexdigest()


def _encode(value: Any) -> tuple[str, bytes]:
    if isinstance(value, bool):
        return "bool", b"1" if value else b"0"
    if isinstance(value, int):
        return "int", str(value).encode()
    if isinstance(value, float):
        return "float", repr(value).encode()
    if isinstance(value, datetime):
        return "time", value.astimezone(UTC).isoformat(timespec="microseconds").encode()
    if isinstance(value, memoryview):
        return "bytes", bytes(value)
    raise TypeError(f"no row hash over a {type(value).__name__}")
