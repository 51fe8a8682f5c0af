"""What a worker does for the service: find the kind's job, validate the request again, run it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from app.designs.kind import Answer, Mode

WarmUp = Callable[[], None]

_LOOSE = 1e-2


def answer(kind_slug: str, mode: str, payload: bytes) -> Answer:
    """Run one job of the registry on a request given as JSON."""
    # Imported here, not above: the service process imports this module too, and needs none of the solvers for it.
    from app.designs.registry import KINDS, job_of

    job = job_of(KINDS[kind_slug], Mode(mode))
    return job.run(job.request.model_validate_json(payload))


@cache
def warm_up() -> None:
    """Solve every kind's own example of every job once, so that no user waits for imports or compilation.

    Loosely: it is the kernels that count, not the digits. A second call, such as that of a worker forked from a warm
    process, does nothing.
    """
    from app.designs.registry import KINDS

    for kind in KINDS.values():
        for mode, job in kind.jobs.items():
            job.run(job.request.model_validate({**kind.example(mode), "accuracy": _LOOSE}))
