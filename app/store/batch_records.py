"""Immutable records of batches, blocks, chunks and items."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import NamedTuple

from app.store.record import new_run_id

NO_ITEM = "00000000"
MOST_ITEMS = 0x7FFF_FFFE
"""Maximum batch size: indices are 32-bit integers on every database."""


class BatchStatus(StrEnum):
    RECEIVING = "receiving"
    """Items are still being stored; not acknowledged, hence hidden."""
    QUEUED = "queued"
    RUNNING = "running"
    ENDED = "ended"
    CANCELLED = "cancelled"


class ChunkState(StrEnum):
    WAITING = "waiting"
    LEASED = "leased"
    DONE = "done"
    CANCELLED = "cancelled"


class ItemStatus(StrEnum):
    SUCCEEDED = "succeeded"
    INFEASIBLE = "infeasible"
    FAILED = "failed"
    REFUSED = "refused"


DAMAGED = "damaged"
"""Status of an item read from a row that does not match its digest; never stored."""
ACTIVE = (BatchStatus.QUEUED, BatchStatus.RUNNING)


@dataclass(frozen=True, kw_only=True)
class BatchRecord:
    """One batch. ``source``: JSON description of how its blocks are parsed; ``dictionary``: preset dictionary for the
    compression of its items. The counters agree with the items at every commit."""

    number: int = 0
    id: str
    kind: str
    mode: str
    name: str | None
    detail: str
    status: str
    source: bytes
    dictionary: bytes
    solver_name: str
    solver_version: str
    total: int = 0
    succeeded: int = 0
    infeasible: int = 0
    failed: int = 0
    refused: int = 0
    created_at: datetime
    started_at: datetime | None = None
    ended_at: datetime | None = None
    owner: str | None = None
    """Id of the API key of the sender."""

    @property
    def done(self) -> int:
        return self.succeeded + self.infeasible + self.failed + self.refused

    @property
    def cancelled(self) -> int:
        """Number of items without an answer in a cancelled batch."""
        return self.total - self.done if self.status == BatchStatus.CANCELLED else 0


@dataclass(frozen=True)
class Block:
    """Packed rows as sent, starting at item index ``first``; see ``batch_inputs``."""

    first: int
    count: int
    content: bytes


@dataclass(frozen=True)
class Chunk:
    """A range of items solved by one worker in one task; ``block`` is the first index of the containing block."""

    batch: int
    first: int
    count: int
    block: int
    attempts: int

    @property
    def end(self) -> int:
        return self.first + self.count


class Item(NamedTuple):
    """One finished item; ``content`` as produced by ``batch_items.packed``. ``asked`` is the request number under which
    equal items look it up; None if it is not to be reused."""

    index: int
    line: int | None
    status: str
    holds: bool | None
    figure: float | None
    content: bytes
    asked: int | None = None


def new_batch_id() -> str:
    """A UUIDv7 whose last 32 bits are zero; item ids carry their index there."""
    return new_run_id()[:-8] + NO_ITEM


def item_id(batch_id: str, index: int) -> str:
    """The run id of an item."""
    return f"{batch_id[:-8]}{index + 1:08x}"


def split_item_id(run_id: str) -> tuple[str, int] | None:
    """The batch id and item index encoded in a run id; None if it cannot be an item's id."""
    try:
        index = int(run_id[-8:], 16) - 1
    except ValueError:
        return None
    if len(run_id) != 36 or not 0 <= index <= MOST_ITEMS or not run_id.isascii():
        return None
    return run_id[:-8] + NO_ITEM, index
