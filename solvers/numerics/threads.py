"""Limit BLAS to one thread, because the matrices are small.

A second thread gains nothing for vectors of about ten thousand numbers, and on a busy machine waiting for it makes a
solution ten times slower.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import ThreadpoolController


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit BLAS to one thread within the block."""
    with _libraries().limit(limits=1, user_api="blas"):
        yield


@cache
def _libraries() -> ThreadpoolController:
    # Finding the loaded libraries takes milliseconds; they do not change after scipy is imported.
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()
