"""Limit BLAS to one thread, because the matrices are small.

A second thread gains nothing for vectors of about ten thousand numbers, and on a busy machine waiting for it makes a
solution ten times slower.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[object]:
    """Limit BLAS to one thread within the block."""
    return _libraries().limit(limits=1, user_api="blas")


@cache
def _libraries() -> ThreadpoolController:
    # Finding the loaded libraries takes milliseconds; they do not change after scipy is imported.
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()
