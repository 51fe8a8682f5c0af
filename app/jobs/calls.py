"""What a worker does for the service: find the kind's job, validate the request again, run it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

from app.designs.kind import Answer, Mode
from app.designs.progress import Report

WarmUp = Callable[[], None]


def answer(kind_slug: str, mode: str, payload: bytes, report: Report) -> Answer:
    """Run one job of the registry on a request given as JSON; a long one reports how far it is."""
    # Imported here, not above: the service process imports this module too, and needs none of the solvers for it.
    from app.designs.registry import KINDS, job_of

    job = job_of(KINDS[kind_slug], Mode(mode))
    return job.solve(job.request.model_validate_json(payload), report)


@cache
def warm_up() -> None:
    """Have everything imported and every kernel compiled, so that no user waits for either.

    The first time on a machine every rehearsal is solved, which fills the kernels' cache on disk; after that the
    examples are enough, solved loosely, which load what is there. A second call, such as that of a worker forked from a
    warm process, does nothing.
    """
    from app.designs.rehearsals import examples, rehearsals

    done = _done()
    known = any(mark.exists() for mark in done)
    for job, request in examples() if known else rehearsals():
        job.run(request)
    if not known:
        _leave_a_mark(done)


def _done() -> list[Path]:
    """Where it may stand written that these very sources were rehearsed: beside numba's own cache, or at home."""
    import numba

    import solvers

    root = Path(solvers.__file__).parent
    digest = hashlib.sha256(f"{numba.__version__} {numba.config.CACHE_DIR}".encode())
    for path in sorted(root.rglob("*.py")):
        digest.update(path.read_bytes())
    name = f"rehearsed-{digest.hexdigest()[:16]}"
    return [root / "__pycache__" / name, Path.home() / ".cache" / "crankwright" / name]


def _leave_a_mark(places: list[Path]) -> None:
    for place in places:
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            place.touch()
        except OSError:
            continue
        return
