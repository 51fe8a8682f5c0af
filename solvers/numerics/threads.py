"""How many threads linear algebra takes: one, where matrices are small.

A second thread gains nothing on vectors of some ten thousand numbers, and on a busy machine waiting for it makes a
solution ten times slower.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import ThreadpoolController


@contextmanager
def one_thread() -> Iterator[None]:
    """Hold the process's BLAS to one thread meanwhile."""
    with _libraries().limit(limits=1, user_api="blas"):
        yield


@cache
def _libraries() -> ThreadpoolController:
    # Finding the loaded libraries takes some milliseconds, and they stay the same once scipy is imported.
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()
