"""Competitors of a rod design: local searches on the project's own check, with exactly the answer's effects.

They start from the answer, from strips a few per cent along its active limits, from the optimum of the core physics,
from corners of the bounds and from random strips that are feasible or nearly so. A competitor counts if the check, at
``ACCURACY``, finds all requirements met; it wins if its objective is better than the answer's by more than the answer's
estimated error and the check's own.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from oracles.rivals import starts
from oracles.rivals.hunt import HOME, Array, Hunt, Look, Space
from oracles.rivals.rod_beside import Beside
from oracles.rivals.search import finish, look_beside
from oracles.rivals.starts import Strength, along, step_along_limits
from solvers import rod
from solvers.errors import InvalidInput
from solvers.fatigue import FatigueCriterion
from solvers.outcome import EffectReport, EffectState, Outcome, Status

ACCURACY = 1e-8
CORE = frozenset({"reciprocating_inertia", "beam_column", "friction"})
ROUGH = 1e-3
_PER_START = 12
"""Random strips evaluated with the core physics per start of a search."""
_MANY, _FROM_CORNERS = 8, 3
"""With more than ``_MANY`` starts, ``_FROM_CORNERS`` of them are corners of the bounds."""
_NO_LOAD = 10.0
"""Logarithmic margin of a safety without a load."""
_NOTHING = Look(math.inf, np.array([math.nan]))
"""Evaluation of a strip whose vibration is unbounded."""

_LEAST: dict[str, Callable[[rod.RodCheck], float | None]] = {
    "min_fatigue_safety": lambda check: check.stresses.fatigue_safety,
    "min_stability_safety": lambda check: check.stability_safety,
    "min_yield_safety": lambda check: check.stresses.yield_safety,
}
_GREATEST: dict[str, Callable[[rod.RodCheck], float | None]] = {
    "max_contact_pressure": lambda check: check.stresses.contact_pressure_max,
    "max_friction_power": lambda check: check.stresses.friction_power,
}


SCOUTS, SEEKERS = Strength(20, 60, ("SLSQP", "COBYQA")), Strength(8, 60, ("SLSQP", "COBYQA"))
"""Effort of the rough searches against an answer, and against a claim of infeasibility."""
ROUGHLY, ROUGHLY_DIFFERENCE = 1e-4, 3e-4
"""Accuracy requested for the checks of rough searches (their errors are 1e-7 in the median and mostly below 3e-6), and
the finite-difference step of their slopes."""
_SMOOTH_HOME, _HOME_IN_GAP = 3e-2, 0.1
"""Distance from the end of an earlier rough search at which another is stopped: in the logarithms of the sizes if the
strip does not vibrate, otherwise as a fraction of the distance between resonances."""
_LED, _FINISHING = 2, 150
"""Number of the best strips of the rough searches from which accurate searches start, and the checks for each
search."""
FINELY, JUDGED = 1e-5, 1e-7
"""Accuracy requested for the checks of the accurate searches (their errors are mostly 1e-8), and for the deciding
checks."""
_HOPE, _ELSEWHERE = 1e-3, 1e-3
"""Accurate searches start only from strips whose logarithmic objective is at most ``_HOPE`` worse than the answer's,
and whose logarithmic sizes differ from each other by at least ``_ELSEWHERE``."""
_GRID_STEPS = 2


@dataclass(frozen=True)
class Contest:
    """Result of the competition against an answer.

    gain         relative improvement of the objective by the best competitor (negative: worse; -inf: none is feasible;
                 inf: one is, although the answer is infeasible)
    estimated    the answer's own error estimate
    missed       relative violation of a requirement by the answer, rechecked
    rival        the best competitor, its objective, and the search that found it
    accuracy     of the deciding checks
    """

    gain: float
    estimated: float
    missed: float
    rival: rod.Dimensions | None
    objective: float | None
    found_by: str
    evaluations: int
    accuracy: float

    @property
    def won(self) -> bool:
        return self.gain > self.estimated + self.accuracy


def settled(effects: tuple[EffectReport, ...]) -> rod.EffectSelection:
    """The selection that activates exactly the effects of a manifest."""
    active = frozenset(e.name for e in effects if e.state is EffectState.ACTIVE)
    return rod.EffectSelection(active, frozenset(e.name for e in effects) - active)


def space_of(problem: rod.RodProblem) -> Space:
    """The sizes allowed by a problem."""
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
    """An evaluator of sizes (b, h, l) [m] with a problem's objective and requirements."""
    asked = problem.requirements

    def look(sizes: Array) -> Look:
        strip = rod.Dimensions(*map(float, sizes))
        found = rod.check(problem.scene, strip, selection, accuracy=accuracy, criterion=criterion).value
        return Look(log_cost(problem, found), margins(asked, found))

    return look


def scout(problem: rod.RodProblem, selection: rod.EffectSelection, accuracy: float) -> Callable[[Array], Look]:
    """As ``looker``, with vibrations solved at the resolution found for a nearby strip: fast, but not accurate enough
    to decide."""
    check, asked = Beside.of(problem, selection, accuracy), problem.requirements

    def look(sizes: Array) -> Look:
        found = check(sizes)
        return _NOTHING if found is None else Look(log_cost(problem, found), margins(asked, found))

    return look


def margins(asked: rod.Requirements, found: rod.RodCheck) -> Array:
    """Logarithmic margins of the requirements, the last one for stability; NaN for a buckled strip."""
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
    """Logarithm of the objective as minimised; inf if undefined."""
    reads_stresses = problem.objective.name not in ("mass", "stability_safety")
    if reads_stresses and found.stresses is None:
        return math.inf
    value = problem.objective.read(found)
    if not value:
        # a safety without a load, or friction power without friction
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
    """Run the competition against an answer."""
    selection, first = settled(outcome.effects), _sizes_of(outcome)
    hunt = Hunt(space_of(problem), looker(problem, selection, accuracy, criterion), first is not None)
    missed = 0.0 if first is None else hunt.at(first).violation
    core, rough = core_optimum(problem, selection), looker(problem, core_of(selection), ROUGH, criterion)
    compete(hunt, first, core, rough, strength, np.random.default_rng(seed))
    return _ended(problem, outcome, hunt, missed, accuracy)


def scouted_contest(problem: rod.RodProblem, outcome: Outcome[rod.RodDesign], seed: int = 0) -> Contest:
    """Run the competition with many starts where checks are expensive.

    Rough searches explore from all starts and, where sizes come in steps, from the grid points next to the answer's
    sizes. The best strips found then compete with the answer in a ``close_contest``.
    """
    selection, first = settled(outcome.effects), _sizes_of(outcome)
    space, found, home = space_of(problem), first is not None, _SMOOTH_HOME
    if "rod_inertia" in selection.include:
        home = _HOME_IN_GAP / _frequency_ratio(problem, outcome) if found else HOME
    scouts = Hunt(space, scout(problem, selection, ROUGHLY), found, ROUGHLY_DIFFERENCE, min(home, _SMOOTH_HOME))
    scouts.target = scouts.merit(first) if found else 0.0
    if found and space.stepped:
        look_beside(scouts, first, _GRID_STEPS, SCOUTS.evaluations)
    core, rough = core_optimum(problem, selection), looker(problem, core_of(selection), ROUGH)
    compete(scouts, first, core, rough, SCOUTS if found else SEEKERS, np.random.default_rng(seed))
    most = scouts.merit(first) + _HOPE if found else _HOPE
    led = scouts.promising(_LED, _ELSEWHERE, most, ROUGHLY, [first] if found else [])
    close = close_contest(problem, outcome, led)
    return replace(close, evaluations=close.evaluations + scouts.evaluations)


def close_contest(
    problem: rod.RodProblem,
    outcome: Outcome[rod.RodDesign],
    others: Sequence[Array] = (),
    evaluations: int = _FINISHING,
    accuracy: float = JUDGED,
) -> Contest:
    """Run the competition close to an answer.

    Candidates are steps along the answer's limits, searches by linear programs and along ridges from the answer
    (``evaluations`` checks each), and the same searches from ``others`` (logarithms of sizes, half as many checks). An
    apparent winner is confirmed by separate checks to ``accuracy``.
    """
    selection, first = settled(outcome.effects), _sizes_of(outcome)
    hunt, missed = Hunt(space_of(problem), scout(problem, selection, FINELY), first is not None), 0.0
    judge = looker(problem, selection, accuracy)
    if first is not None:
        missed = judge(hunt.space.sizes(first)[0]).violation
        step_along_limits(hunt, first)
        finish(hunt, first, evaluations)
    for start in others:
        finish(hunt, start, evaluations // 2)
    close = _ended(problem, outcome, hunt, missed, accuracy)
    if not close.won:
        return close
    # Search again from the apparent winner, now with the deciding check.
    judged = Hunt(hunt.space, judge, hunt.seeking)
    finish(judged, np.log(hunt.best[1]), evaluations)
    return replace(_ended(problem, outcome, judged, missed, accuracy), found_by=hunt.found_by)


def _frequency_ratio(problem: rod.RodProblem, outcome: Outcome[rod.RodDesign]) -> float:
    """omega_1/omega of an answer; resonances lie at integer ratios."""
    return outcome.value.check.natural_frequency / problem.scene.mechanism.speed


def _sizes_of(outcome: Outcome[rod.RodDesign]) -> Array | None:
    """Logarithms of an answer's sizes; None without an answer."""
    if outcome.status is not Status.SUCCEEDED:
        return None
    strip = outcome.value.check.dimensions
    return np.log([strip.b, strip.h, strip.l])


def _ended(
    problem: rod.RodProblem, outcome: Outcome[rod.RodDesign], hunt: Hunt, missed: float, accuracy: float
) -> Contest:
    """The result of a hunt."""
    estimated = outcome.accuracy.estimated
    if hunt.best is None:
        return Contest(-math.inf, estimated, missed, None, None, "", hunt.evaluations, accuracy)
    cost, sizes = hunt.best
    gain = math.expm1(log_cost(problem, outcome.value.check) - cost) if hunt.seeking else math.inf
    value = math.exp(problem.objective.sign * cost)
    strip = rod.Dimensions(*map(float, sizes))
    return Contest(gain, estimated, missed, strip, value, hunt.found_by, hunt.evaluations, accuracy)


def compete(
    hunt: Hunt,
    first: Array | None,
    core: Array | None,
    rough: Callable[[Array], Look],
    strength: Strength,
    rng: np.random.Generator,
) -> None:
    """Search from the answer, from strips along its limits, the core optimum, more strips along the limits, and random
    strips."""
    near = [] if first is None else [first, *along(hunt, first, rng, 1)]
    if first is not None:
        step_along_limits(hunt, first)
    if core is not None:
        near.append(core)
    far = []
    if first is not None and strength.starts > _MANY:
        far += along(hunt, first, rng, strength.starts // 4)
    if strength.starts > _MANY:
        far += _corners(hunt.space, rough, _FROM_CORNERS)
    far += _random(hunt.space, rough, rng, max(strength.starts - len(near) - len(far), 0))
    starts.compete(hunt, near, far, strength)


def core_of(selection: rod.EffectSelection) -> rod.EffectSelection:
    """The selected effects restricted to the core physics."""
    active = selection.include & CORE
    return rod.EffectSelection(active, frozenset(e.name for e in rod.EFFECTS) - active)


def core_optimum(problem: rod.RodProblem, selection: rod.EffectSelection) -> Array | None:
    """Logarithmic sizes of the core physics' optimum, if any."""
    try:
        core = rod.design(problem, core_of(selection))
    except InvalidInput:
        return None
    if core.status is not Status.SUCCEEDED:
        return None
    strip = core.value.check.dimensions
    return np.log([strip.b, strip.h, strip.l])


def _corners(space: Space, rough: Callable[[Array], Look], count: int) -> list[Array]:
    """The ``count`` most promising corners of the bounds."""
    corners = [np.log(corner) for corner in itertools.product(*zip(space.lower, space.upper, strict=True))]
    return sorted(corners, key=lambda logs: _rank(rough(space.sizes(logs)[0])))[:count]


def _rank(look: Look) -> tuple[float, float]:
    """Sort key: feasible strips first, by cost; then the others, by violation."""
    missed = float(np.nan_to_num(-look.margins, nan=1.0).max(initial=0.0))
    return missed, look.cost if look.violation == 0 else 0.0


def _random(space: Space, rough: Callable[[Array], Look], rng: np.random.Generator, count: int) -> list[Array]:
    """Random strips within the bounds; of every dozen, the best feasible one or the least infeasible."""
    out = []
    for _ in range(count):
        drawn = rng.uniform(np.log(space.lower), np.log(space.upper), (_PER_START, 3))
        looks = [rough(space.sizes(logs)[0]) for logs in drawn]
        ranks = [_rank(look) for look in looks]
        out.append(drawn[min(range(_PER_START), key=ranks.__getitem__)])
    return out
