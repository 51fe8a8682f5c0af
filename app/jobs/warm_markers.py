"""Marker files that record which kernels have been compiled on this machine from the current sources.

A marker lies beside numba's cache, or in the user's cache directory if that is read-only. Its name contains a digest of
the sources, the versions of Python and numba, and the processor; it lists the cache files it vouches for. If it or one
of those is missing, its rehearsals are solved again, and numba compiles only the kernels that are missing or changed.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

Part = tuple[str, str]
"""``(kind slug, mode)``"""


def exists(part: Part) -> bool:
    """Whether the part's kernels were compiled and their cache files still exist."""
    return any(_is_valid(_path(directory, part)) for directory in _directories())


def write(part: Part, files: Iterable[Path] = ()) -> None:
    """Record that the part's kernels were compiled into these files; silently skipped if no directory is writable."""
    for directory in _directories():
        try:
            directory.mkdir(parents=True, exist_ok=True)
            _path(directory, part).write_text("\n".join(map(str, files)), "utf-8")
        except OSError:
            continue
        return


def _is_valid(marker: Path) -> bool:
    try:
        files = marker.read_text("utf-8").splitlines()
    except OSError:
        return False
    return all(map(os.path.exists, files))


def _path(directory: Path, part: Part) -> Path:
    return directory / f"rehearsed-{part[0]}-{part[1]}-{_digest()}"


@cache
def _directories() -> tuple[Path, ...]:
    import solvers

    return Path(solvers.__file__).parent / "__pycache__", Path.home() / ".cache" / "crankwright"


@cache
def _digest() -> str:
    import numba
    from llvmlite.binding import get_host_cpu_features, get_host_cpu_name

    import solvers
    from app.designs import rehearsals

    name, features = numba.config.CPU_NAME, numba.config.CPU_FEATURES
    processor = f"{name or get_host_cpu_name()} {get_host_cpu_features().flatten() if features is None else features}"
    versions = f"{sys.version} {numba.__version__} {platform.machine()} {numba.config.CACHE_DIR}"
    digest = hashlib.sha256(f"{versions} {processor}".encode())
    root = Path(solvers.__file__).parent
    for path in [Path(rehearsals.__file__), *sorted(root.rglob("*.py"))]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
