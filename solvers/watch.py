"""Cooperative time limits."""

from __future__ import annotations

import time
from collections.abc import Callable


class OutOfTime(Exception):
    """The time limit was exceeded."""


class Watch:
    """A time limit [s] from construction; calling it raises OutOfTime once exceeded."""

    def __init__(self, seconds: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock, self._end = clock, clock() + seconds

    def __call__(self) -> None:
        if self._clock() > self._end:
            raise OutOfTime


def no_watch() -> None:
    """No time limit."""


def in_time(watch: Callable[[], None]) -> bool:
    """Whether a time limit has not been exceeded yet."""
    try:
        watch()
    except OutOfTime:
        return False
    return True
