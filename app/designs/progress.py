"""Progress of long solves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """``done`` of at most ``of`` solutions are found; ``doing`` describes the current step."""

    done: int
    of: int
    doing: str


Report = Callable[[Progress], None]


def ignore_progress(_progress: Progress) -> None:
    """No-op report."""


class Counter:
    """Counts solutions and reports progress."""

    def __init__(self, of: int, report: Report) -> None:
        self._done, self._of, self._report, self._doing = 0, of, report, ""

    def begin(self, doing: str) -> None:
        self._doing = doing
        self._tell()

    def increment(self) -> None:
        self._done += 1
        self._tell()

    def _tell(self) -> None:
        self._report(Progress(self._done, max(self._of, self._done), self._doing))
