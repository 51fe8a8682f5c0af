"""A strip on the full model: whether it will do, what it costs, and how it shifts the limits of the search."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from solvers.outcome import Outcome
from solvers.rod.check import RodCheck
from solvers.rod.optimum import constraints as rows
from solvers.rod.optimum.full_model.tilt import own_rows
from solvers.rod.optimum.peak_model import SIDEWAYS, STRESS
from solvers.rod.optimum.proof.outer_approximation import Proof
from solvers.rod.optimum.sqp import Limits, Polished
from solvers.rod.problem import Objective, Requirements, RodProblem
from solvers.rod.scene import Dimensions

BOXES = 20_000
GUARD = 0.1
AGREED = 0.25
"""Shares of the accuracy: how far to the safe side limits are shifted, and how far apart shifts may be in the end."""
SAFE = 1.0 + 1e-9
"""The least stability safety that a search is asked for."""

Evaluate = Callable[[Dimensions, float], Outcome[RodCheck]]
"""The full model's check of a strip, to an accuracy."""


@dataclass(frozen=True)
class Found:
    """A strip that meets every requirement on the full model, and the search that it comes from.

    ``shifted`` is where the full model would shift the limits once more; ``rough`` is what slopes were wrong by at the
    last strip that they said to be better and that was not, in ln objective.
    """

    best: Polished
    outcome: Outcome[RodCheck]
    limits: Limits
    proof: Proof
    shifted: Limits
    rough: float = 0.0


def limits_of(problem: RodProblem) -> Limits:
    """The requirements as the search's limits, unshifted."""
    r = problem.requirements
    stress = None if r.min_yield_safety is None else problem.scene.material.yield_strength / r.min_yield_safety
    return Limits(
        r.min_fatigue_safety, max(r.min_stability_safety, SAFE), stress, r.max_contact_pressure, r.max_friction_power
    )


def cost(objective: Objective, result: RodCheck) -> float:
    """The objective as made small; that of a safety without a load to fail under is the best of all."""
    value = objective.read(result)
    return objective.sign * (math.inf if value is None else value)


def own_cost(objective: Objective, best: Polished) -> float:
    """ln objective on the search's model, as made small."""
    own = own_rows(best.focus, best.dimensions)
    return float(sum(weight * own[row] for row, weight in objective.weights))


def meets(result: RodCheck, r: Requirements) -> bool:
    """Whether a strip, not beyond buckling, meets every requirement."""
    s = result.stresses
    fatigue = math.inf if s.fatigue_safety is None else s.fatigue_safety
    stability = math.inf if result.stability_safety is None else result.stability_safety
    strength = math.inf if s.yield_safety is None else s.yield_safety
    return (
        fatigue >= r.min_fatigue_safety
        and stability >= r.min_stability_safety
        and (r.min_yield_safety is None or strength >= r.min_yield_safety)
        and (r.max_contact_pressure is None or s.contact_pressure_max <= r.max_contact_pressure)
        and (r.max_friction_power is None or s.friction_power <= r.max_friction_power)
    )


def shifted_limits(problem: RodProblem, best: Polished, full: RodCheck, guard: float) -> Limits:
    """The limits moved by the ratio of own values to the full model's, and by ``guard`` to the safe side."""
    r, s = problem.requirements, full.stresses
    own = own_rows(best.focus, best.dimensions)

    def least(required: float | None, mine: float, theirs: float | None) -> float | None:
        return None if required is None else required * (1.0 + guard) * (mine / theirs if theirs else 1.0)

    def most(required: float | None, mine: float, theirs: float | None) -> float | None:
        return None if required is None else required * (1.0 - guard) * (mine / theirs if theirs else 1.0)

    # Stresses in the ratio of the yield safeties, theirs to mine: a least safety turned into a greatest stress.
    strength, highest = problem.scene.material.yield_strength, math.exp(own[STRESS])
    stress = (
        None if r.min_yield_safety is None else strength / least(r.min_yield_safety, strength / highest, s.yield_safety)
    )
    stability = math.exp(-max(own[rows.STABILITY], own[SIDEWAYS]))
    return Limits(
        least(r.min_fatigue_safety, math.exp(-own[rows.UTILISATION]), s.fatigue_safety),
        max(least(r.min_stability_safety, stability, full.stability_safety), SAFE),
        stress,
        most(r.max_contact_pressure, math.exp(own[rows.PRESSURE]), s.contact_pressure_max),
        most(r.max_friction_power, math.exp(own[rows.POWER]), s.friction_power),
    )  # fmt: skip


def apart(a: Limits, b: Limits) -> float:
    """The greatest relative difference of two sets of limits."""
    pairs = [(getattr(a, n), getattr(b, n)) for n in a.__dataclass_fields__]
    return max(abs(x / y - 1.0) for x, y in pairs if x is not None and y is not None)
