"""Records of stored runs: frozen data, JSON parts as the exact bytes that were returned."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum


class RunStatus(StrEnum):
    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    INFEASIBLE = "infeasible"
    FAILED = "failed"
    CANCELLED = "cancelled"


OPEN_STATUSES = (RunStatus.QUEUED, RunStatus.RUNNING)
ANSWERED_STATUSES = (RunStatus.SUCCEEDED, RunStatus.INFEASIBLE)


@dataclass(frozen=True, kw_only=True)
class RunRecord:
    """A stored run, whatever its outcome.

    ``spec``, ``result``, ``problem``, ``effects``, ``accuracy``, ``timing`` and ``verdict`` are UTF-8 JSON, stored and
    returned byte for byte. ``holds`` is the verdict's, None without one; ``figure`` is the headline number of the
    result and ``figure_name`` its name, None if there is none. ``created_at`` must be timezone-aware; it is stored in
    UTC to the microsecond. ``spec_hash`` comes from ``app.store.hashing.spec_hash``. ``source_run_ids`` are the runs
    this one takes data from. ``owner`` is the id of the key that requested it, None without access control.
    """

    id: str
    kind: str
    mode: str
    status: str
    name: str | None
    created_at: datetime
    spec: bytes
    spec_hash: str
    result: bytes | None = None
    problem: bytes | None = None
    effects: bytes = b"[]"
    accuracy: bytes | None = None
    timing: bytes = b"{}"
    solver_name: str
    solver_version: str
    cached: bool = False
    batch_id: str | None = None
    source_run_ids: tuple[str, ...] = ()
    verdict: bytes | None = None
    holds: bool | None = None
    figure_name: str | None = None
    figure: float | None = None
    owner: str | None = None


@dataclass(frozen=True)
class Finish:
    """The final state of a run: everything unknown while it was queued."""

    status: str
    result: bytes | None = None
    problem: bytes | None = None
    effects: bytes = b"[]"
    accuracy: bytes | None = None
    timing: bytes = b"{}"
    verdict: bytes | None = None
    holds: bool | None = None
    figure_name: str | None = None
    figure: float | None = None


@dataclass(frozen=True)
class RunSummary:
    """A run in a listing: without its JSON parts, except for its accuracy."""

    id: str
    kind: str
    mode: str
    status: str
    name: str | None
    created_at: datetime
    spec_hash: str
    solver_name: str
    solver_version: str
    cached: bool
    batch_id: str | None
    accuracy: bytes | None
    holds: bool | None
    figure_name: str | None
    figure: float | None


@dataclass(frozen=True)
class RunFilter:
    """Conditions combined with AND; None does not restrict.

    ``name`` matches exactly, ``text`` any part of the name, case-insensitively; ``created_after`` and
    ``created_before`` are exclusive.
    """

    kind: str | None = None
    mode: str | None = None
    status: str | None = None
    name: str | None = None
    batch_id: str | None = None
    created_after: datetime | None = None
    holds: bool | None = None
    text: str | None = None
    created_before: datetime | None = None


class RunOrder(StrEnum):
    """Sort order of a listing. By name or figure, only runs that have one are listed."""

    NEWEST = "newest"
    OLDEST = "oldest"
    NAME = "name"
    LEAST = "least"
    GREATEST = "greatest"


ITEM_ORDERS = (RunOrder.NEWEST, RunOrder.OLDEST, RunOrder.LEAST, RunOrder.GREATEST)
"""Orders of the items of a batch, whose names have no index."""


@dataclass(frozen=True)
class RunPage:
    """A page of runs; ``next_cursor`` is None on the last page, ``damaged`` the ids of runs of this page whose rows do
    not match their hashes."""

    items: tuple[RunSummary, ...]
    next_cursor: str | None
    damaged: tuple[str, ...] = ()


@dataclass(frozen=True)
class StoredResponse:
    """An HTTP response stored under an idempotency key, to be replayed byte for byte."""

    key: str
    request_hash: str
    run_id: str
    status_code: int
    location: str | None
    content_type: str
    body: bytes


def utc_now() -> datetime:
    return datetime.now(UTC)


def new_run_id() -> str:
    """A UUIDv7 (RFC 9562): 48 bits of Unix milliseconds and 74 random bits; sorts by time to the millisecond."""
    milliseconds = time.time_ns() // 1_000_000
    random_bits = int.from_bytes(os.urandom(10), "big")
    high = (milliseconds << 16) | 0x7000 | ((random_bits >> 62) & 0x0FFF)
    low = (0b10 << 62) | (random_bits & ((1 << 62) - 1))
    digits = f"{high:016x}{low:016x}"
    return f"{digits[:8]}-{digits[8:12]}-{digits[12:16]}-{digits[16:20]}-{digits[20:]}"
