"""Visibility of runs, enforced in the store: every read and write of runs applies the current viewer.

The default, in force on the command line, at start-up and in the service's own work, sees everything.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True)
class Viewer:
    """``owner`` is assigned to new runs; ``everything``: runs of other owners are visible too."""

    owner: str | None = None
    everything: bool = True


viewer: ContextVar[Viewer] = ContextVar("viewer", default=Viewer())  # noqa: B039 (frozen)
"""The viewer of the current task and of the tasks it creates."""


@contextmanager
def seeing_as(owner: str | None) -> Iterator[None]:
    """Act as an owner, for work done later on their behalf; None acts without restriction."""
    token = viewer.set(Viewer(owner, everything=owner is None))
    try:
        yield
    finally:
        viewer.reset(token)


def own_key(key: str) -> str:
    """An idempotency key as stored, scoped to its owner. A header has no newline, so keys of different owners cannot
    collide."""
    owner = viewer.get().owner
    return key if owner is None else f"{owner}\n{key}"
