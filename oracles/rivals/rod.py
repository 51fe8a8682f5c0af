"""Rivals of a rod's design: local searches on the project's own check, with the very effects of the answer.

They start from the answer, from strips a few percent along the limits that hold it, from the optimum of the core's
physics, and from random strips that keep the limits, or nearly. A rival counts where the check, to ``ACCURACY``, finds
every requirement met, and wins where its objective is better than the answer's by more than the answer estimates, and
the check itself may be off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oracles.rivals import starts
from oracles.rivals.hunt import Array, Hunt, Look, Space
from oracles.rivals.starts import Strength, along, step_along_limits
from solvers import rod
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion
from solvers.outcome import EffectReport, EffectState, Outcome, Status

ACCURACY = 1e-8
CORE = frozenset({"reciprocating_inertia", "beam_column", "friction"})
ROUGH = 1e-3
_PER_START = 12
"""Random strips looked at, by the core's physics, for every one that a search starts from."""
_MANY = 8
_NO_LOAD = 10.0
"""By how much, as a logarithm, a safety is kept that there is no load for."""

_LEAST: dict[str, Callable[[rod.RodCheck], float | None]] = {
    "min_fatigue_safety": lambda check: check.stresses.fatigue_safety,
    "min_stability_safety": lambda check: check.stability_safety,
    "min_yield_safety": lambda check: check.stresses.yield_safety,
}
_GREATEST: dict[str, Callable[[rod.RodCheck], float | None]] = {
    "max_contact_pressure": lambda check: check.stresses.contact_pressure_max,
    "max_friction_power": lambda check: check.stresses.friction_power,
}


WEAK = Strength(3, 60, ("SLSQP", "linear programs"))
STRONG = Strength(20, most=4000)


@dataclass(frozen=True)
class Contest:
    """What became of the rivals of an answer.

    gain         by what share of its objective the best rival is better (negative: worse; -inf: none keeps the limits;
                 inf: one does, where the answer is that none can)
    estimated    what the answer estimates: its own error
    missed       by what share the answer misses a requirement, checked anew
    rival        the best one, and its objective, and the way that found it
    """

    gain: float
    estimated: float
    missed: float
    rival: rod.Dimensions | None
    objective: float | None
    found_by: str
    evaluations: int

    @property
    def won(self) -> bool:
        return self.gain > self.estimated + ACCURACY


def settled(effects: tuple[EffectReport, ...]) -> rod.EffectSelection:
    """The selection that runs just the effects that a manifest says ran."""
    active = frozenset(e.name for e in effects if e.state is EffectState.ACTIVE)
    return rod.EffectSelection(active, frozenset(e.name for e in effects) - active)


def space_of(problem: rod.RodProblem) -> Space:
    """The sizes that a problem allows."""
    bounds = problem.bounds
    lower = np.array([bounds.b[0], bounds.h[0], bounds.l[0]])
    upper = np.array([bounds.b[1], bounds.h[1], min(bounds.l[1], problem.scene.mechanism.rod_length)])

    def multiples(step: float | None, i: int) -> Array | None:
        if step is None:
            return None
        first, last = math.ceil(lower[i] / step * (1 - 1e-12)), math.floor(upper[i] / step * (1 + 1e-12))
        return np.clip(np.arange(first, last + 1) * step, lower[i], upper[i])

    stock = None
    if problem.stock_h is not None:
        stock = np.array(sorted({h for h in problem.stock_h if lower[1] <= h <= upper[1]}))
    return Space(lower, upper, (multiples(problem.step_b, 0), stock, multiples(problem.step_l, 2)))


def looker(
    problem: rod.RodProblem,
    selection: rod.EffectSelection,
    accuracy: float = ACCURACY,
    criterion: FatigueCriterion | None = None,
) -> Callable[[Array], Look]:
    """What the check says of sizes (b, h, l) [m] by a problem's objective and requirements."""
    asked = problem.requirements

    def look(sizes: Array) -> Look:
        strip = rod.Dimensions(*map(float, sizes))
        found = rod.check(problem.scene, strip, selection, accuracy=accuracy, criterion=criterion).value
        return Look(log_cost(problem, found), margins(asked, found))

    return look


def margins(asked: rod.Requirements, found: rod.RodCheck) -> Array:
    """By how much, as logarithms, each requirement is kept; NaN where the strip buckles and there is nothing to read.
    The last is that it does not."""
    stands = found.stresses is not None
    out = []
    for name, read in _LEAST.items():
        least = getattr(asked, name)
        if least is not None:
            value = read(found) if stands or name == "min_stability_safety" else math.nan
            out.append(_NO_LOAD if value is None else math.log(value / least))
    for name, read in _GREATEST.items():
        most = getattr(asked, name)
        if most is not None:
            value = read(found) if stands else math.nan
            out.append(_NO_LOAD if not value else math.log(most / value))
    out.append(_NO_LOAD if found.stability_safety is None else math.log(found.stability_safety))
    return np.array(out)


def log_cost(problem: rod.RodProblem, found: rod.RodCheck) -> float:
    """The logarithm of the objective, as made small; inf where it cannot be read."""
    reads_stresses = problem.objective.name not in ("mass", "stability_safety")
    if reads_stresses and found.stresses is None:
        return math.inf
    value = problem.objective.read(found)
    if not value:
        # A safety without a load to fail under; a friction without friction.
        return -1e3
    return problem.objective.sign * math.log(value)


def contest(
    problem: rod.RodProblem,
    outcome: Outcome[rod.RodDesign],
    strength: Strength,
    seed: int = 0,
    accuracy: float = ACCURACY,
    criterion: FatigueCriterion | None = None,
) -> Contest:
    """Put an answer to its rivals."""
    selection = settled(outcome.effects)
    look, found = looker(problem, selection, accuracy, criterion), outcome.status is Status.SUCCEEDED
    hunt = Hunt(space_of(problem), look, seeking=found)
    own, missed, first = math.nan, 0.0, None
    if found:
        check = outcome.value.check
        own, strip = log_cost(problem, check), check.dimensions
        first = np.log([strip.b, strip.h, strip.l])
        missed = hunt.at(first).violation
    core, rough = core_optimum(problem, selection), looker(problem, core_of(selection), ROUGH, criterion)
    compete(hunt, first, core, rough, strength, np.random.default_rng(seed))
    if hunt.best is None:
        return Contest(-math.inf, outcome.accuracy.estimated, missed, None, None, "", hunt.evaluations)
    cost, sizes = hunt.best
    gain = math.expm1(own - cost) if found else math.inf
    value = math.exp(problem.objective.sign * cost)
    strip = rod.Dimensions(*map(float, sizes))
    return Contest(gain, outcome.accuracy.estimated, missed, strip, value, hunt.found_by, hunt.evaluations)


def compete(
    hunt: Hunt,
    first: Array | None,
    core: Array | None,
    rough: Callable[[Array], Look],
    strength: Strength,
    rng: np.random.Generator,
) -> None:
    """Search from the answer, a strip along its limits, the core's optimum, more along the limits, random strips."""
    near = [] if first is None else [first, *along(hunt, first, rng, 1)]
    if first is not None:
        step_along_limits(hunt, first)
    if core is not None:
        near.append(core)
    far = []
    if first is not None and strength.starts > _MANY:
        far += along(hunt, first, rng, strength.starts // 4)
    far += _random(hunt.space, rough, rng, max(strength.starts - len(near) - len(far), 0))
    starts.compete(hunt, near, far, strength)


def core_of(selection: rod.EffectSelection) -> rod.EffectSelection:
    """Of the effects selected, those of the core's physics alone."""
    active = selection.include & CORE
    return rod.EffectSelection(active, frozenset(e.name for e in rod.EFFECTS) - active)


def core_optimum(problem: rod.RodProblem, selection: rod.EffectSelection) -> Array | None:
    """Logarithms of the sizes that the core's physics wants, if there are such."""
    try:
        core = rod.design(problem, core_of(selection))
    except InvalidInput:
        return None
    if core.status is not Status.SUCCEEDED:
        return None
    strip = core.value.check.dimensions
    return np.log([strip.b, strip.h, strip.l])


def _random(space: Space, rough: Callable[[Array], Look], rng: np.random.Generator, count: int) -> list[Array]:
    """Random strips over the whole bounds; of every dozen the one that keeps the limits best, or is the best that keeps
    them."""
    out = []
    for _ in range(count):
        drawn = rng.uniform(np.log(space.lower), np.log(space.upper), (_PER_START, 3))
        looks = [rough(space.sizes(logs)[0]) for logs in drawn]
        ranks = [
            (float(np.nan_to_num(-look.margins, nan=1.0).max(initial=0.0)), look.cost if look.violation == 0 else 0.0)
            for look in looks
        ]
        out.append(drawn[min(range(_PER_START), key=ranks.__getitem__)])
    return out
