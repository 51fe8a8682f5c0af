"""Messages between the batch engine and a worker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.store.batch_records import Item


@dataclass(frozen=True)
class Task:
    """Items ``start`` to ``end`` of a block of the batch with this number; ``first`` is the index of the item at
    ``start``.

    ``runs``: stored runs referenced by the items, as JSON by run id; None for a run that does not exist.
    ``looks_up``: whether to look up equal items already answered in other chunks.
    ``known``: those items by the numbers requested in ``Needs``; None before the lookup.
    """

    batch: int
    source: bytes
    block: bytes
    start: int
    end: int
    first: int
    detail: str
    dictionary: bytes
    solve_budget_s: float
    looks_up: bool
    runs: Mapping[str, bytes | None] = field(default_factory=dict)
    known: Mapping[int, Item] | None = None


@dataclass(frozen=True)
class Needs:
    """Data the worker lacks: the runs referenced by the items, or else the stored items equal to the chunk's."""

    run_ids: frozenset[str]
    asked: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Solved:
    """The solved items of a chunk, ``sealed``, the elapsed time, and the processor's [s]."""

    items: bytes
    seconds: float
    processor_s: float
