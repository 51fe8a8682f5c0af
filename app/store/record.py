"""The stored run and its companions: plain frozen data, JSON parts as the exact bytes that were answered."""

from __future__ import annotations

import os
import time
import uuid
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


@dataclass(frozen=True)
class RunRecord:
    """One run as stored, whatever its outcome.

    ``spec``, ``result``, ``problem``, ``effects``, ``accuracy``, ``timing``, ``verdict`` are UTF-8 JSON, kept and
    returned byte for byte; ``holds`` is the verdict's own, None where there is no verdict; ``figure`` is the number of
    the result that matters most, ``figure_name`` its name, None where there is none. ``created_at`` must be aware; it
    is kept in UTC to the microsecond. ``spec_hash`` comes from ``app.store.hashing.spec_hash``. ``source_run_ids``
    names the runs that fed this one. ``owner`` is the id of the key that asked for it, None where none was needed.
    """

    id: str
    kind: str
    mode: str
    status: str
    name: str | None
    created_at: datetime
    spec: bytes
    spec_hash: str
    result: bytes | None
    problem: bytes | None
    effects: bytes
    accuracy: bytes | None
    timing: bytes
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
    """How an open run ends: everything that was unknown while it was queued."""

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
    """A line of the listing: the run without its JSON parts."""

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
    holds: bool | None
    figure_name: str | None
    figure: float | None


@dataclass(frozen=True)
class RunFilter:
    """Conditions that all hold; None does not restrict. ``name`` matches exactly, ``text`` anywhere in the name without
    regard to case, ``created_after`` and ``created_before`` are exclusive."""

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
    """How a listing is sorted. By name or figure only runs that have one are listed."""

    NEWEST = "newest"
    OLDEST = "oldest"
    NAME = "name"
    LEAST = "least"
    GREATEST = "greatest"


@dataclass(frozen=True)
class RunPage:
    """Runs in the order asked for; ``next_cursor`` is None on the last page. ``damaged`` are the ids of runs that
    belong here too, but whose rows no longer say what was written."""

    items: tuple[RunSummary, ...]
    next_cursor: str | None
    damaged: tuple[str, ...] = ()


@dataclass(frozen=True)
class StoredResponse:
    """An HTTP answer kept under an idempotency key, to be given again byte for byte."""

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
    """A UUID of version 7 (RFC 9562): 48 bits of Unix milliseconds, then 74 random bits.

    Sortable by time to the millisecond, and no easier to guess than 74 random bits.
    """
    milliseconds = time.time_ns() // 1_000_000
    random_bits = int.from_bytes(os.urandom(10), "big")
    high = (milliseconds << 16) | 0x7000 | ((random_bits >> 62) & 0x0FFF)
    low = (0b10 << 62) | (random_bits & ((1 << 62) - 1))
    return str(uuid.UUID(int=(high << 64) | low))
