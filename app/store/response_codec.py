"""Compact encoding of the responses stored under idempotency keys.

A response is the run as JSON, whose parts are already stored byte for byte in the run's row. Only the text between the
parts and their order is stored, so that any later version reproduces the response exactly, at a hundredth of the size.
"""

from __future__ import annotations

import json
import zlib

from app.store.record import OPEN_STATUSES, RunRecord

_MAGIC = b"\x00parts:"
"""Prefix of encoded responses; no JSON starts with it, so older responses stored in full are recognised."""
_PARTS = ("verdict", "spec", "result", "problem", "effects", "accuracy", "timing")
_IMMUTABLE = ("spec",)
"""Parts that do not change when an open run ends."""
_MIN_BYTES = 16


def pack(body: bytes, run: RunRecord) -> bytes:
    """Encode a response body, leaving out the run's parts."""
    pieces: list[tuple[int, str]] = []
    between, at = [], 0
    for name in _IMMUTABLE if run.status in OPEN_STATUSES else _PARTS:
        part: bytes | None = getattr(run, name)
        found = body.find(part, at) if part is not None and len(part) >= _MIN_BYTES else -1
        if part is None or found < 0:
            continue
        pieces.append((found - at, name))
        between.append(body[at:found])
        at = found + len(part)
    order = json.dumps(pieces, separators=(",", ":")).encode()
    return _MAGIC + zlib.compress(order + b"\n" + b"".join(between) + body[at:], 9)


def unpack(content: bytes, run: RunRecord) -> bytes:
    """Reconstruct the response body. Raises ValueError if the content is damaged."""
    if not content.startswith(_MAGIC):
        return content
    try:
        order, _, between = zlib.decompress(content[len(_MAGIC) :]).partition(b"\n")
    except zlib.error as error:
        raise ValueError("the answer cannot be read") from error
    found, at = [], 0
    for length, name in json.loads(order):
        found += [between[at : at + length], getattr(run, name)]
        at += length
    return b"".join(found) + between[at:]
