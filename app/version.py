"""Name and version of the solver, recorded with every run."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

NAME = "crankwright"

try:
    VERSION = version(NAME)
except PackageNotFoundError:  # an uninstalled source tree
    VERSION = "0+unknown"
