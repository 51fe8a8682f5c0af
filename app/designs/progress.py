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


def ignore_progress(_progress: Progress) -> None:
    """Progress that nobody waits for."""


class Count:
    """Counts solutions, of so many, and reports them."""

    def __init__(self, of: int, report: Report) -> None:
        self._done, self._of, self._report, self._doing = 0, of, report, ""

    def begin(self, doing: str) -> None:
        self._doing = doing
        self._tell()

    def one(self) -> None:
        self._done += 1
        self._tell()

    def _tell(self) -> None:
        self._report(Progress(self._done, max(self._of, self._done), self._doing))
