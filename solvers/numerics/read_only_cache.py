"""Compiled kernels on disk that can be read but not written, as in a container with a read-only file system.

numba accepts a cache directory only if it can write there; without one it refuses to compile cached functions at all.
Its variable ``NUMBA_CACHE_LOCATOR_CLASSES`` lists where it looks, in order; the locators defined here follow numba's
own.
"""

from __future__ import annotations

import os
from typing import Any

from numba.core.caching import InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator


def _require_compiled_kernels(locator: Any) -> None:
    """Raise OSError if the locator's directory does not exist or holds no compiled kernels."""
    if not any(name.endswith(".nbi") for name in os.listdir(locator.get_cache_path())):
        raise FileNotFoundError(locator.get_cache_path())


class Provided(UserProvidedCacheLocator):
    """The directory that ``NUMBA_CACHE_DIR`` names."""

    ensure_cache_path = _require_compiled_kernels


class UserWide(UserWideCacheLocator):
    """The user's cache directory."""

    ensure_cache_path = _require_compiled_kernels


class InTree(InTreeCacheLocator):
    """``__pycache__`` next to the source."""

    ensure_cache_path = _require_compiled_kernels
