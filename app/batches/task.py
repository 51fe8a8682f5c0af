"""What passes between the engine and a worker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.store.batch_records import Item


@dataclass(frozen=True)
class Task:
    """Items ``start`` to ``end`` of a block; ``first`` is the index of the item at ``start``. ``runs`` are stored runs
    that the items name, as JSON; None stands for one that does not exist.

    ``looks_up`` is true where it is worth while to look for equal items that other chunks have answered. ``known`` has
    those by the numbers that ``Needs`` asked for; None before anybody has looked.
    """

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
    """What the worker was not given: stored runs that the items name; else items that ask the same as the chunk's."""

    run_ids: frozenset[str]
    asked: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Solved:
    """The items of a chunk, and what they took."""

    items: list[Item]
    seconds: float
