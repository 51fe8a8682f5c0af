"""Answers kept under idempotency keys, without what the run's own row has already.

An answer is the run as JSON, whose parts are stored byte for byte beside it. What is kept is the little in between and
the order of the parts, so the answer comes back byte for byte by any later version, at a hundredth of the room.
"""

from __future__ import annotations

import json
import zlib

from app.store.record import OPEN_STATUSES, RunRecord

_MARK = b"\x00parts:"
"""No JSON begins like this, so answers that were kept whole are told from these."""
_PARTS = ("verdict", "spec", "result", "problem", "effects", "accuracy", "timing")
_LASTING = ("spec",)
"""Parts of an open run that its end does not change."""
_LEAST = 16


def packed(body: bytes, run: RunRecord) -> bytes:
    """The answer without the run's parts."""
    pieces: list[tuple[int, str]] = []
    between, at = [], 0
    for name in _LASTING if run.status in OPEN_STATUSES else _PARTS:
        part: bytes | None = getattr(run, name)
        found = body.find(part, at) if part is not None and len(part) >= _LEAST else -1
        if part is None or found < 0:
            continue
        pieces.append((found - at, name))
        between.append(body[at:found])
        at = found + len(part)
    order = json.dumps(pieces, separators=(",", ":")).encode()
    return _MARK + zlib.compress(order + b"\n" + b"".join(between) + body[at:], 9)


def unpacked(content: bytes, run: RunRecord) -> bytes:
    """The answer as it was given. Raises ValueError for a content that was damaged."""
    if not content.startswith(_MARK):
        return content
    try:
        order, _, between = zlib.decompress(content[len(_MARK) :]).partition(b"\n")
    except zlib.error as error:
        raise ValueError("the answer cannot be read") from error
    found, at = [], 0
    for length, name in json.loads(order):
        found += [between[at : at + length], getattr(run, name)]
        at += length
    return b"".join(found) + between[at:]
