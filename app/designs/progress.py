"""How far a long solve is, told while it runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """So many solutions are there, of at most so many; ``doing`` says what is under way."""

    done: int
    of: int
    doing: str


Report = Callable[[Progress], None]


def to_nobody(_progress: Progress) -> None:
    """Progress that nobody waits for."""
