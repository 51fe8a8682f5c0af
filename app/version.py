"""Name and version of the solver, as every run records them."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

NAME = "crankwright"

try:
    VERSION = version(NAME)
except PackageNotFoundError:  # a source tree that was never installed
    VERSION = "0+unknown"
