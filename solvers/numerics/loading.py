"""Loading cached machine code without importing the compiler.

Before loading a kernel, numba imports everything needed to compile: two hundred modules, several times slower than
loading the kernels of a check. Here that is postponed until a kernel is not found on disk.

This relies on internals of numba's cache; if they differ from what is expected, numba's own mechanism is used.
"""

from __future__ import annotations

from typing import Any


def load_without_compiler(cache: Any) -> None:
    """Make a dispatcher's cache load without preparing to compile."""
    load, guarded = getattr(cache, "_load_overload", None), getattr(cache, "_guard_against_spurious_io_errors", None)
    if load is None or guarded is None:
        return
    from numba.core.runtime import rtsys

    def load_overload(signature: Any, context: Any) -> Any:
        # Arrays allocated by a kernel are reference-counted by numba's runtime, with which its code is linked.
        rtsys.initialize(context)
        with guarded():
            return load(signature, context)

    cache.load_overload = load_overload
