"""What passes between the engine and a worker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.store.batch_records import Item


@dataclass(frozen=True)
class Task:
    """Items ``start`` to ``end`` of a block; ``first`` is the index of the item at ``start``. ``runs`` are stored runs
    that the items name, as JSON; None stands for one that does not exist."""

    source: bytes
    block: bytes
    start: int
    end: int
    first: int
    detail: str
    dictionary: bytes
    solve_budget_s: float
    runs: Mapping[str, bytes | None] = field(default_factory=dict)


@dataclass(frozen=True)
class Needs:
    """The chunk names stored runs that the worker was not given."""

    run_ids: frozenset[str]


@dataclass(frozen=True)
class Solved:
    """The items of a chunk, and what they took."""

    items: list[Item]
    seconds: float
