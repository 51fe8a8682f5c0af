"""A time budget for work that can look at a clock now and then."""

from __future__ import annotations

import time
from collections.abc import Callable


class OutOfTime(Exception):
    """The work was given up: its time was over."""


class Watch:
    """Counts a time [s] from its making; a call raises OutOfTime once that is over."""

    def __init__(self, seconds: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock, self._end = clock, clock() + seconds

    def __call__(self) -> None:
        if self._clock() > self._end:
            raise OutOfTime
