"""The HTTP service and command line over ``solvers``."""

import os

# The solvers' matrices are small: more BLAS threads gain nothing, and slow a check tenfold when all cores are busy.
# numpy reads this once, on its first import.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# numba refuses a cache directory that it cannot write: a service on a read-only file system could not solve anything.
# Its own locations come first, in its own order; numba reads this on its first import.
_LOCATORS = ["UserProvidedCacheLocator", "InTreeCacheLocator", "UserWideCacheLocator"]
_LOCATORS += ["IPythonCacheLocator", "ZipCacheLocator"]
_LOCATORS += [f"solvers.numerics.read_only_cache.{name}" for name in ("Provided", "UserWide", "InTree")]
os.environ.setdefault("NUMBA_CACHE_LOCATOR_CLASSES", ",".join(_LOCATORS))
