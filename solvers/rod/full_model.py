"""The strip that the full model wants, found by a search that knows only gas load, inertia, beam-column and contact.

The search's limits are shifted by what the full model says at the strip found, and the search is done again until both
agree. What the effects beyond the search's physics change, they change by a little more or less at the next strip: in
the end the search's results are tilted as well (``solvers.rod.tilt``), and the strip moves to where the full model's
own slopes balance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from solvers.outcome import Outcome
from solvers.rod import rows
from solvers.rod.certificate import Proof, Sizes, search
from solvers.rod.check import RodCheck
from solvers.rod.focus import SIDEWAYS, STRESS
from solvers.rod.machine import Machine
from solvers.rod.polish import Limits, Polished, matters, polish
from solvers.rod.problem import Bounds, Objective, Requirements, RodProblem
from solvers.rod.scene import Dimensions
from solvers.rod.scout import scout
from solvers.rod.tilt import Tilt, logarithms, measured, own_rows

BOXES = 20_000
_CORRECTIONS = 6
_COARSE = (1e-2, 1e-2, 1e-4)
"""Accuracies of the first looks at the full model."""
_GUARD = 0.1
_AGREED = 0.25
"""Shares of the accuracy: how far to the safe side limits are shifted, and how far apart shifts may be in the end."""
_STEEPEST = 0.5
_SETTLING, _FAILURES, _SHORT, _REACH, _LESS, _FAR, _ROUGH = 24, 5, 2, 0.15, 0.25, 0.02, 1e-5
"""Settling: looks at the full model, how many of them may be no better, how many in a row short of a limit, how far one
may go in logarithms, by what less after a step that failed, how far slopes hold, and how exact the looks are that they
come from."""
_SAFE = 1.0 + 1e-9

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
    r = problem.requirements
    stress = None if r.min_yield_safety is None else problem.scene.material.yield_strength / r.min_yield_safety
    return Limits(
        r.min_fatigue_safety, max(r.min_stability_safety, _SAFE), stress, r.max_contact_pressure, r.max_friction_power
    )


def on_full_model(
    problem: RodProblem,
    machine: Machine,
    limits: Limits,
    sizes: Sizes,
    evaluate: Evaluate,
    accuracy: float,
    beyond_core: bool,
) -> tuple[Found | None, Proof]:
    """Search, look at the full model, shift the limits by the difference, and again until both agree.

    Where the full model is more than the search's own physics, the first looks are coarse ones: the strip still moves.
    From the second look on the shift is that of a secant, since the difference itself changes with the strip.
    """
    objective = problem.objective
    coarse = [a for a in _COARSE if a > accuracy] if beyond_core else []
    guard = _GUARD * accuracy if beyond_core else 0.0
    enough = _AGREED * accuracy if beyond_core else 0.1 * accuracy
    proof = search(machine, objective, limits, sizes, accuracy, BOXES)
    best, found, before = proof.best, None, None
    for look in range(_CORRECTIONS + len(coarse)):
        if best is None:
            break
        final = look >= len(coarse)
        outcome = evaluate(best.dimensions, min(accuracy, 1e-6) if final else coarse[look])
        if outcome.value.stresses is None:
            limits, before, apart = replace(limits, stability=1.1 * limits.stability), None, math.inf
        else:
            shifted = _shifted(problem, best, outcome.value, guard)
            apart = _apart(shifted, limits)
            if final and _meets(outcome.value, problem.requirements):
                better = found is None or _cost(objective, outcome.value) < _cost(objective, found.outcome.value)
                found = Found(best, outcome, limits, proof, shifted) if better else found
                if apart <= enough or not better:
                    break
            limits, before = _secant(before, (limits, shifted)), (limits, shifted)
        if apart > 0.05 * accuracy or sizes.discrete:
            # The optimum itself may move elsewhere, and its bound with it.
            proof = search(machine, objective, limits, sizes, accuracy, BOXES)
            best = proof.best
        else:
            best = polish(machine, objective, limits, sizes.around(best.dimensions), best.dimensions)
    if beyond_core:
        found = found or _scouted(problem, machine, sizes, evaluate, accuracy)
        found = found and _settled(problem, machine, sizes, found, evaluate, accuracy)
    return found, proof


def _scouted(problem: RodProblem, machine: Machine, sizes: Sizes, evaluate: Evaluate, accuracy: float) -> Found | None:
    """An admissible strip that no search led to."""
    objective = problem.objective
    strip = scout(lambda d: evaluate(d, _COARSE[0]).value, sizes, problem.requirements, objective)
    if strip is None:
        return None
    outcome = evaluate(strip, min(accuracy, 1e-6))
    if outcome.value.stresses is None or not _meets(outcome.value, problem.requirements):
        return None
    focus, angles = machine.focus_at(strip.b, strip.h, strip.l, matters(objective, limits_of(problem)))
    best = Polished(strip, 0.0, focus, angles)
    best = replace(best, log_cost=_own_cost(objective, best))
    limits = _shifted(problem, best, outcome.value, 0.0)
    return Found(best, outcome, limits, search(machine, objective, limits, sizes, accuracy, BOXES), limits)


@dataclass
class _Stand:
    """A strip to go on from: what the full model says of it, the limits that shifts to, and the tilt, once measured."""

    strip: Polished
    full: RodCheck
    limits: Limits
    tilt: Tilt | None = None


def _settled(
    problem: RodProblem, machine: Machine, sizes: Sizes, found: Found, evaluate: Evaluate, accuracy: float
) -> Found:
    """The strip moved to where the full model's own slopes balance, as far as that makes it better."""
    objective, density = problem.objective, problem.scene.material.density
    reach, failures, short = _REACH, 0, 0

    def step(here: _Stand) -> Polished | None:
        """The best strip of sizes that are to be had, near the best one of any size."""
        at, tilt = here.strip.dimensions, here.tilt
        best = polish(machine, objective, here.limits, _within(sizes.bounds, at, reach), at, tilt)
        if best is None or not sizes.discrete:
            return best
        strip = best.dimensions
        return polish(machine, objective, here.limits, sizes.around(strip), strip, tilt)

    start, here = found, _Stand(found.best, found.outcome.value, found.shifted)
    home = here
    for _ in range(_SETTLING):
        if here.tilt is None:
            strip, look = here.strip, lambda d: evaluate(d, _ROUGH).value
            here.tilt = measured(strip.focus, strip.dimensions, here.full, look, sizes.bounds)
        best = step(here) if failures < _FAILURES else None
        moved = 0.0 if best is None else float(np.max(np.abs(logarithms(best.dimensions) - here.tilt.at)))
        # A strip that does not meet the limits yet may be short of them by less than that.
        if best is None or (moved < _AGREED * accuracy and here is home):
            break
        outcome = evaluate(best.dimensions, min(accuracy, 1e-6))
        full = outcome.value
        if full.stresses is None:
            here, reach, failures = home, _LESS * moved, failures + 1
            continue
        meets = _meets(full, problem.requirements)
        if meets and _cost(objective, full) >= _cost(objective, home.full):
            # Too far for slopes, or no smooth place.
            if moved <= _FAR:
                foretold = best.log_cost - here.strip.log_cost
                found_out = objective.log_cost(full, density) - objective.log_cost(here.full, density)
                found = replace(found, rough=abs(found_out - foretold))
            here, reach, failures = home, _LESS * moved, failures + 1
            continue
        tilted, shifted = (
            _tilted(here.limits, here.tilt, best.dimensions),
            _shifted(problem, best, full, _GUARD * accuracy),
        )
        strip = replace(best, log_cost=_own_cost(objective, best))
        tilt = here.tilt._replace(at=logarithms(best.dimensions)) if moved <= _FAR else None
        found = Found(strip, outcome, tilted, found.proof, shifted) if meets else found
        here = _Stand(strip, full, shifted, tilt)
        home, short = (here, 0) if meets else (home, short + 1)
        if short > _SHORT:
            here, reach, failures, short = home, _LESS * reach, failures + 1, 0
        if meets and _apart(shifted, tilted) <= _AGREED * accuracy:
            break
    if home.strip is start.best:
        return found
    # The bound is one of the search's physics with limits as the full model shifts them at the answer.
    return replace(found, limits=found.shifted, proof=search(machine, objective, found.shifted, sizes, accuracy, BOXES))


def _within(box: Bounds, d: Dimensions, reach: float) -> Bounds:
    """The part of a box that lies no further from a strip, in logarithms."""
    return Bounds(
        *(
            (max(low, min(size * math.exp(-reach), high)), min(high, max(size * math.exp(reach), low)))
            for (low, high), size in zip((box.b, box.h, box.l), (d.b, d.h, d.l), strict=True)
        )
    )


def _tilted(limits: Limits, tilt: Tilt, d: Dimensions) -> Limits:
    """Limits of a strip's own rows that are those of tilted ones."""
    change = tilt.change(logarithms(d))

    def moved(limit: float | None, row: int, sign: float) -> float | None:
        return None if limit is None else limit * math.exp(sign * change[row])

    return Limits(
        moved(limits.fatigue, rows.UTILISATION, 1.0),
        max(moved(limits.stability, rows.STABILITY, 1.0), _SAFE),
        moved(limits.stress, STRESS, -1.0),
        moved(limits.pressure, rows.PRESSURE, -1.0),
        moved(limits.power, rows.POWER, -1.0),
    )


def _own_cost(objective: Objective, best: Polished) -> float:
    own = own_rows(best.focus, best.dimensions)
    return float(sum(weight * own[row] for row, weight in objective.weights))


def _secant(before: tuple[Limits, Limits] | None, now: tuple[Limits, Limits]) -> Limits:
    """Where shifted limits will be equal to the limits that they come from, by one look or by two."""
    if before is None:
        return now[1]
    values = {}
    for name in Limits.__dataclass_fields__:
        points = [getattr(limits, name) for limits in (*before, *now)]
        values[name] = points[3]
        if None in points:
            continue
        x0, g0, x1, g1 = map(math.log, points)
        # Neighbouring floats may have the same logarithm.
        if x0 != x1:
            slope = min(max((g1 - g0) / (x1 - x0), -_STEEPEST), _STEEPEST)
            values[name] = math.exp(x1 + (g1 - x1) / (1.0 - slope))
    return Limits(**values | {"stability": max(values["stability"], _SAFE)})


def _cost(objective: Objective, result: RodCheck) -> float:
    value = objective.read(result)
    return -objective.sign * math.inf if value is None else objective.sign * value


def _meets(result: RodCheck, r: Requirements) -> bool:
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


def _shifted(problem: RodProblem, best: Polished, full: RodCheck, guard: float) -> Limits:
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
        max(least(r.min_stability_safety, stability, full.stability_safety), _SAFE),
        stress,
        most(r.max_contact_pressure, math.exp(own[rows.PRESSURE]), s.contact_pressure_max),
        most(r.max_friction_power, math.exp(own[rows.POWER]), s.friction_power),
    )  # fmt: skip


def _apart(a: Limits, b: Limits) -> float:
    """The greatest relative difference of two sets of limits."""
    pairs = [(getattr(a, n), getattr(b, n)) for n in a.__dataclass_fields__]
    return max(abs(x / y - 1.0) for x, y in pairs if x is not None and y is not None)
