"""Division of array rows among threads; kernels release the GIL."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import TypeVar

T = TypeVar("T")


def in_slices(solve: Callable[[slice], T], count: int, threads: int) -> list[T]:
    """Call ``solve`` for consecutive slices of ``count`` rows, one for each thread, and return its results in order."""
    parts = max(min(threads, count), 1)
    slices = [slice(first, last) for first, last in pairwise(count * part // parts for part in range(parts + 1))]
    if parts == 1:
        return [solve(slices[0])]
    with ThreadPoolExecutor(parts) as pool:
        return list(pool.map(solve, slices))
