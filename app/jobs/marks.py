"""Marks on disk that say which kernels this machine has compiled from the sources at hand.

A mark lies beside numba's own cache, or in the user's cache where that cannot be written. Its name bears a digest of
the sources, the versions of Python and the compiler, and the processor; in it stand the files that it speaks for. Where
it or one of these is missing its rehearsal is solved again; numba then compiles those kernels alone that are not there
or whose sources have changed.
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
"""Slug of a kind, and a mode of it."""


def is_left(part: Part) -> bool:
    """Whether this part's kernels were compiled, and still lie where they were put."""
    return any(_holds(_name(place, part)) for place in _places())


def leave(part: Part, files: Iterable[Path] = ()) -> None:
    """Say that they were, and lie in these files."""
    for place in _places():
        try:
            place.mkdir(parents=True, exist_ok=True)
            _name(place, part).write_text("\n".join(map(str, files)), "utf-8")
        except OSError:
            continue
        return


def _holds(mark: Path) -> bool:
    try:
        files = mark.read_text("utf-8").splitlines()
    except OSError:
        return False
    return all(map(os.path.exists, files))


def _name(place: Path, part: Part) -> Path:
    return place / f"rehearsed-{part[0]}-{part[1]}-{_digest()}"


@cache
def _places() -> tuple[Path, ...]:
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
