"""Machine code from the disk without the compiler: a kernel that is kept there needs nothing of it but the linker.

Before it loads a kernel, numba imports all that it can compile: two hundred modules, which takes several times as long
as to load what a check calls. Here that is left to the first kernel that is not on disk.

This reaches into numba's cache; where that looks otherwise than expected, numba goes its own way.
"""

from __future__ import annotations

from typing import Any


def load_alone(cache: Any) -> None:
    """Have a dispatcher's cache load without preparing to compile."""
    load, guarded = getattr(cache, "_load_overload", None), getattr(cache, "_guard_against_spurious_io_errors", None)
    if load is None or guarded is None:
        return
    from numba.core.runtime import rtsys

    def load_overload(signature: Any, context: Any) -> Any:
        # Arrays that a kernel makes are counted by numba's runtime, which a kernel's code is linked with.
        rtsys.initialize(context)
        with guarded():
            return load(signature, context)

    cache.load_overload = load_overload
