"""Looking for an admissible strip anywhere, with the full model alone.

Where effects beyond the search's physics change from strip to strip, as near a resonance, shifting the search's limits
may lead nowhere although there are admissible strips. Then strips spread evenly over all sizes (I. M. Sobol's sequence)
are put to the full model, and from the one that misses the requirements least, if that is not by far, the miss is made
smaller by a derivative-free search (T. M. Ragonneau's COBYQA, as scipy's).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from solvers.rod.check import RodCheck
from solvers.rod.optimum.proof.outer_approximation import Sizes
from solvers.rod.problem import Objective, Requirements
from solvers.rod.scene import Dimensions

STRIPS = 16
_LOOKS, _HOPELESS = 24, 0.3
"""Further looks, and from which miss on none are taken."""
_FIRST, _LAST = 0.05, 1e-3
"""First and last radius of the derivative-free search, in logarithms."""
_ROOM = 1e-3
"""By how much the requirements are to be met, in logarithms: a later look is more exact than these."""
_BUCKLED = 10.0

Look = Callable[[Dimensions], RodCheck]


def miss(check: RodCheck, r: Requirements) -> float:
    """The greatest logarithm by which a requirement is missed; 0 or less where all are met."""
    s = check.stresses
    if s is None:
        return _BUCKLED - math.log(check.stability_safety)
    least = (
        (r.min_fatigue_safety, s.fatigue_safety),
        (r.min_stability_safety, check.stability_safety),
        (r.min_yield_safety, s.yield_safety),
    )
    most = (s.contact_pressure_max, r.max_contact_pressure), (s.friction_power, r.max_friction_power)
    return max((math.log(a / b) for a, b in (*least, *most) if a and b), default=0.0)


def scout(look: Look, sizes: Sizes, requirements: Requirements, objective: Objective) -> Dimensions | None:
    """A strip that meets the requirements, the best of those looked at; None where none was found."""
    from scipy.optimize import minimize
    from scipy.stats.qmc import Sobol

    low, high = np.log([sizes.bounds.b, sizes.bounds.h, sizes.bounds.l]).T
    seen: list[tuple[float, float, Dimensions]] = []

    def missed(x: np.ndarray) -> float:
        strip = _to_be_had(sizes, Dimensions(*np.exp(np.clip(x, low, high)).tolist()))
        check = look(strip)
        by = miss(check, requirements) + _ROOM
        value = None if check.stresses is None else objective.read(check)
        seen.append((max(by, 0.0), math.inf if value is None else objective.sign * value, strip))
        return by

    starts = low + (high - low) * Sobol(3, scramble=False).random(STRIPS)
    for start in starts:
        missed(start)
    least = min(range(STRIPS), key=lambda k: seen[k][:2])
    if 0.0 < seen[least][0] < _HOPELESS and np.any(high > low):
        minimize(
            missed,
            starts[least],
            method="COBYQA",
            bounds=list(zip(low, high, strict=True)),
            options={"maxfev": _LOOKS, "initial_tr_radius": _FIRST, "final_tr_radius": _LAST, "f_target": 0.0},
        )
    by, _, strip = min(seen, key=lambda one: one[:2])
    return strip if by == 0.0 else None


def _to_be_had(sizes: Sizes, d: Dimensions) -> Dimensions:
    """The nearest strip of sizes that are to be had."""
    near = sizes.around(d)
    b, h, l = (
        min(max(size, low), high) for size, (low, high) in zip((d.b, d.h, d.l), (near.b, near.h, near.l), strict=True)
    )
    return Dimensions(b, h, l)
