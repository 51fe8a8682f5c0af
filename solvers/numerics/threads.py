"""Limit BLAS to one thread, because the matrices are small.

A second thread gains nothing for vectors of about ten thousand numbers, and on a busy machine waiting for it makes a
solution ten times slower.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import LibController, ThreadpoolController


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit BLAS to one thread within the block."""
    multithreaded = [(library, threads) for library in _libraries() if (threads := library.get_num_threads() or 1) > 1]
    for library, _ in multithreaded:
        library.set_num_threads(1)
    try:
        yield
    finally:
        for library, threads in multithreaded:
            library.set_num_threads(threads)


@cache
def _libraries() -> tuple[LibController, ...]:
    # Finding the loaded libraries takes milliseconds; they do not change after scipy is imported.
    import scipy.linalg  # noqa: F401

    return tuple(one for one in ThreadpoolController().lib_controllers if one.user_api == "blas")
