"""Whose runs a reader sees: kept beside the code that reads, so that no reader can forget to ask.

Every read and write of runs looks here by itself. Nothing is set on the command line, at the start and in the service's
own work: they see all.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True)
class Viewer:
    """``owner`` is whose runs new ones are; ``everything`` is whether others' are seen too."""

    owner: str | None = None
    everything: bool = True


viewer: ContextVar[Viewer] = ContextVar("viewer", default=Viewer())  # noqa: B039 (frozen)
"""Who looks, in this task and those that come from it."""


@contextmanager
def seeing_as(owner: str | None) -> Iterator[None]:
    """Look with the eyes of an owner, for work that is done for him later; without an owner, with everybody's."""
    token = viewer.set(Viewer(owner, everything=owner is None))
    try:
        yield
    finally:
        viewer.reset(token)


def own_key(key: str) -> str:
    """An idempotency key as it is kept: everybody's are his own. No header, so no key, has a line end."""
    owner = viewer.get().owner
    return key if owner is None else f"{owner}\n{key}"
