"""Imports that are not held up by looking for garbage, of which they leave none."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def undisturbed() -> Iterator[None]:
    """No search for garbage meanwhile, nor later among what was made until then: modules live as long as the process.

    Python otherwise looks through all of them again and again, which is a twelfth of a start.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
