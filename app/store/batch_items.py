"""Compact encoding of an item's answer (a few hundred bytes), and its decoding into a run record."""

from __future__ import annotations

import hashlib
import json
import pickle
import zlib
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any

from pydantic_core import to_json

from app.names import cleaned
from app.store.batch_records import BatchRecord, Item, ItemStatus, item_id
from app.store.hashing import canonical_json, canonical_spec, spec_hash
from app.store.record import RunRecord, RunStatus

_LEVEL, _MEMORY, _LARGEST_WINDOW, _LEAST_WINDOW = 3, 5, 15, 12
DIGEST_BYTES = 16
_PARTS = ("spec", "result", "problem", "effects", "accuracy", "timing", "verdict")


def encoded(spec: bytes | None, parts: Mapping[str, Any]) -> bytes:
    """The parts of an answered item as JSON, the encoded ``spec`` first."""
    return joined(spec, parts_json(parts))


def parts_json(parts: Mapping[str, Any]) -> bytes:
    """The parts of an answer, or those of an item beside its spec, as JSON; non-finite numbers as NaN and Infinity."""
    return to_json(parts)


def joined(spec: bytes | None, parts: bytes, cached: bool = False) -> bytes:
    """The JSON of an item: its spec joined to its other parts, each a JSON object without spaces.

    ``cached`` marks an item answered from an equal one.
    """
    fields = [] if spec is None else [b'"spec":' + spec]
    if parts != b"{}":
        fields.append(parts[1:-1])
    if cached:
        fields.append(b'"cached":true')
    return b"{" + b",".join(fields) + b"}"


def packed(content: bytes, dictionary: bytes) -> bytes:
    """The JSON of an answered item, compressed by DEFLATE with the batch's preset dictionary."""
    deflate = _deflate(dictionary).copy()
    return deflate.compress(content) + deflate.flush()


@lru_cache(maxsize=8)
def _deflate(dictionary: bytes) -> Any:
    """A compressor with the preset dictionary, to be copied for each item: copying costs less than loading the
    dictionary again.

    The copy includes the compressor's window, which is therefore only as large as needed to reach the same place of the
    dictionary from an item.
    """
    window = min(_LARGEST_WINDOW, max(_LEAST_WINDOW, (3 * len(dictionary) // 2).bit_length()))
    return zlib.compressobj(_LEVEL, zlib.DEFLATED, -window, _MEMORY, zlib.Z_DEFAULT_STRATEGY, dictionary)


def unpacked(content: bytes, dictionary: bytes) -> dict[str, Any]:
    """Inverse of ``packed``, parsed. Raises ValueError for damaged content."""
    try:
        inflate = zlib.decompressobj(-_LARGEST_WINDOW, dictionary)
        return json.loads(inflate.decompress(content) + inflate.flush())
    except (zlib.error, ValueError) as error:
        raise ValueError("the content of the item cannot be read") from error


ITEM_COLUMNS = ("batch", "index", "line", "status", "holds", "figure", "content", "digest", "asked")


def sealed(batch: int, items: Iterable[Item]) -> bytes:
    """Items as pickled table rows, digests included, so that processes in between pass them on unread."""
    return pickle.dumps(
        [
            (
                batch, item.index, item.line, str(item.status), item.holds, item.figure, item.content,
                digest(batch, item), item.asked,
            )
            for item in items
        ],
        pickle.HIGHEST_PROTOCOL,
    )  # fmt: skip


def unsealed(rows: bytes) -> list[tuple[Any, ...]]:
    """Inverse of ``sealed``: the values of ``ITEM_COLUMNS`` for each item."""
    return pickle.loads(rows)


def digest(batch: int, item: Item) -> bytes:
    """Truncated SHA-256 over all columns of the item's row."""
    # repr of a float is exact and portable; the lengths delimit the parts.
    head = repr((batch, item.index, item.line, str(item.status), item.holds, item.figure, len(item.content)))
    return hashlib.sha256(head.encode() + item.content).digest()[:DIGEST_BYTES]


def run_of(batch: BatchRecord, item: Item) -> RunRecord:
    """The item as a run record; a refused item is a failed run whose problem describes the request."""
    parts = unpacked(item.content, batch.dictionary)
    bytes_of = {name: None if parts.get(name) is None else canonical_json(parts[name]) for name in _PARTS}
    spec = bytes_of["spec"] or b"{}"
    return _run(
        batch,
        item.index,
        status=RunStatus.FAILED if item.status == ItemStatus.REFUSED else item.status,
        name=name_of(parts.get("spec")),
        spec=spec,
        spec_hash=spec_hash(batch.kind, batch.mode, spec),
        result=bytes_of["result"],
        problem=bytes_of["problem"],
        effects=bytes_of["effects"] or b"[]",
        accuracy=bytes_of["accuracy"],
        timing=bytes_of["timing"] or b"{}",
        cached=bool(parts.get("cached")),
        verdict=bytes_of["verdict"],
        holds=item.holds,
        figure_name=parts.get("figure_name"),
        figure=item.figure,
    )


def open_run(batch: BatchRecord, index: int, status: str, body: dict[str, Any]) -> RunRecord:
    """An unanswered item as a run record; its spec is the body as sent."""
    spec, digest = canonical_spec(batch.kind, batch.mode, body)
    return _run(batch, index, status=status, name=name_of(body), spec=spec, spec_hash=digest)


def _run(batch: BatchRecord, index: int, **own: Any) -> RunRecord:
    """An item as a run record: what all items of the batch share, and its ``own``."""
    return RunRecord(
        id=item_id(batch.id, index),
        kind=batch.kind,
        mode=batch.mode,
        created_at=batch.created_at,
        solver_name=batch.solver_name,
        solver_version=batch.solver_version,
        batch_id=batch.id,
        owner=batch.owner,
        **own,
    )


def name_of(spec: Any) -> str | None:
    """The name in a request, also in one that is not valid: cleaned, at most 200 characters; None if absent or not
    text."""
    name = spec.get("name") if isinstance(spec, dict) else None
    return cleaned(name)[:200] or None if isinstance(name, str) else None
