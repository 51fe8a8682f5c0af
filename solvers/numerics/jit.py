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


def reducing_kernel(function: F) -> F:
    """As ``kernel``, for loops that take greatest and least values: assumes no NaN and no care for the sign of zero.

    Without that promise a maximum is a chain of comparisons that no processor can take several at a time. Sums and
    products keep their order and rounding.
    """
    options = {"cache": True, "error_model": "numpy", "nogil": True, "fastmath": {"nnan", "nsz"}}
    return numba.njit(**options)(function)  # type: ignore[return-value]
