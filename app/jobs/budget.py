"""How long a solver may take, and when its process is killed.

A solver that ends by itself with the best it has found is told to end before it would be killed: between the two lies a
margin for reading the clock, for finishing the step under way, and for handing the answer over.
"""

from __future__ import annotations

from dataclasses import dataclass

_LEAST_MARGIN_S, _MARGIN_SHARE, _LEAST_SHARE = 0.5, 0.1, 0.5


@dataclass(frozen=True)
class Budget:
    """Wall-clock seconds: what the solver is told, None for nothing, and after what its process is killed."""

    solver_s: float | None
    kill_s: float


def budget(service_s: float, asked_s: float | None, ends_by_itself: bool) -> Budget:
    """The times of one solve within the service's own limit, which a request can only shorten.

    A solver that does not look at the clock is killed at what was asked for. One that does is told that time, or what
    the margin leaves of the service's limit (half of a short limit), and is killed a margin later.
    """
    if not ends_by_itself:
        return Budget(None, service_s if asked_s is None else min(service_s, asked_s))
    margin = max(_LEAST_MARGIN_S, _MARGIN_SHARE * service_s)
    most = max(service_s - margin, _LEAST_SHARE * service_s)
    told = most if asked_s is None else min(most, asked_s)
    return Budget(told, min(service_s, told + margin))
