"""One place for how kernels are compiled: cached on disk, IEEE arithmetic, no hidden threads."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numba

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile ``function`` for the machine at hand, keep the machine code on disk, leave IEEE rules intact.

    ``error_model="numpy"`` lets divisions by zero give inf, as in numpy, so that loops vectorise.
    """
    return numba.njit(cache=True, error_model="numpy", nogil=True)(function)  # type: ignore[return-value]


def inline(function: F) -> F:
    """As ``kernel``, for small functions that are to vanish into the loops that call them."""
    return numba.njit(cache=True, error_model="numpy", nogil=True, inline="always")(function)  # type: ignore[return-value]
