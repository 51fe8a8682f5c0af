"""Batches, their pieces and their items: plain frozen data."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from app.store.record import new_run_id

NO_ITEM = "00000000"
MOST_ITEMS = 0x7FFF_FFFE
"""More items no batch has: an index is a 32-bit integer on every database."""


class BatchStatus(StrEnum):
    RECEIVING = "receiving"
    """Its items are being stored and nothing was acknowledged yet: nobody is shown such a batch."""
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


ACTIVE = (BatchStatus.QUEUED, BatchStatus.RUNNING)


@dataclass(frozen=True)
class BatchRecord:
    """One batch. ``source`` is JSON that tells how its blocks are read; ``dictionary`` is what the contents of its
    items are compressed with; the counters agree with its items at every commit."""

    number: int
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
    total: int
    succeeded: int
    infeasible: int
    failed: int
    refused: int
    created_at: datetime
    started_at: datetime | None
    ended_at: datetime | None

    @property
    def done(self) -> int:
        return self.succeeded + self.infeasible + self.failed + self.refused

    @property
    def cancelled(self) -> int:
        """Items that will never have an answer."""
        return self.total - self.done if self.status == BatchStatus.CANCELLED else 0

    owner: str | None = None
    """The id of the key that sent it."""


@dataclass(frozen=True)
class Block:
    """Items as they were sent, from the index ``first`` on: see ``batch_inputs``."""

    first: int
    count: int
    content: bytes


@dataclass(frozen=True)
class Chunk:
    """A range of items that one worker is to solve at once; ``block`` is the first index of the block they are in."""

    batch: int
    first: int
    count: int
    block: int
    attempts: int

    @property
    def end(self) -> int:
        return self.first + self.count


@dataclass(frozen=True)
class Item:
    """One ended item; ``content`` is what ``batch_items.packed`` made. ``asked`` is a number by which it is found where
    an equal one is to be solved, None where nobody looks."""

    index: int
    line: int | None
    status: str
    holds: bool | None
    figure: float | None
    content: bytes
    asked: int | None = None


@dataclass(frozen=True)
class BatchPage:
    """Batches, newest first; ``next_cursor`` is None on the last page."""

    items: tuple[BatchRecord, ...]
    next_cursor: str | None


def new_batch_id() -> str:
    """A UUID of version 7 that ends in 32 zero bits: the ids of its items have their number there."""
    return new_run_id()[:-8] + NO_ITEM


def item_id(batch_id: str, index: int) -> str:
    """The id of an item as a run."""
    return f"{batch_id[:-8]}{index + 1:08x}"


def split_item_id(run_id: str) -> tuple[str, int] | None:
    """The batch's id and the index that a run's id stands for, if it is the id of an item."""
    try:
        index = int(run_id[-8:], 16) - 1
    except ValueError:
        return None
    if len(run_id) != 36 or not 0 <= index <= MOST_ITEMS or not run_id.isascii():
        return None
    return run_id[:-8] + NO_ITEM, index
