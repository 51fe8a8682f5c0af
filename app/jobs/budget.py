"""Time limits of a solve: of its solver, and of its process.

A solver that stops by itself with the best solution found gets a limit somewhat before its process is killed. The
margin covers reading the clock, finishing the current step and sending the answer.
"""

from __future__ import annotations

from dataclasses import dataclass

_MIN_MARGIN_S, _MARGIN_SHARE, _MIN_SHARE = 0.5, 0.1, 0.5


@dataclass(frozen=True)
class Budget:
    """Seconds of wall-clock time: the solver's own limit (None for no limit), and when its process is killed."""

    solver_s: float | None
    kill_s: float


def budget(service_s: float, asked_s: float | None, ends_by_itself: bool) -> Budget:
    """Time limits of a solve within the service's limit, which a request can only shorten.

    A solver that does not look at the clock is killed at the requested time. One that does gets that time, at most what
    the margin leaves of the service's limit (half of a short limit), and is killed one margin later.
    """
    if not ends_by_itself:
        return Budget(None, service_s if asked_s is None else min(service_s, asked_s))
    margin = max(_MIN_MARGIN_S, _MARGIN_SHARE * service_s)
    maximum = max(service_s - margin, _MIN_SHARE * service_s)
    limit = maximum if asked_s is None else min(maximum, asked_s)
    return Budget(limit, min(service_s, limit + margin))
