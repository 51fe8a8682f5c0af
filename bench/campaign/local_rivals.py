"""Competitors: answers of neighbouring problems, and local searches on the check.

If a limit is slightly looser, the answer must not be heavier; and an answer at a looser limit that meets the tighter
one competes with the tighter answer. Local searches (SLSQP, Nelder-Mead) start from the answer and others around it and
only use the check.

``beaten``: relative distance of the best feasible competitor beyond the certificate's bound (0: none); ``better``:
beyond the answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from solvers import linkage, pin
from solvers.linkage.mechanism.closure import Closure
from solvers.linkage.optimum.family import FURTHER, Family
from solvers.outcome import Outcome

STEPS = (1e-4, 1e-3, 1e-2)
"""Relative changes of the neighbours' limits."""
PIN_LIMITS = ("max_deflection", "max_ovalization", "max_slope", "min_wall")
LINKAGE_LIMITS = ("longest_link", "enclosing_radius", "width", "height", "max_pin_force")
_FEASIBILITY_TOLERANCE = 1e-9
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Judged:
    """Statistics of competitors: number, feasible ones, and what the best shows."""

    tried: int = 0
    kept: int = 0
    beaten: float = 0.0
    better: float = 0.0

    def __or__(self, other: Judged) -> Judged:
        return Judged(
            self.tried + other.tried, self.kept + other.kept, max(self.beaten, other.beaten),
            max(self.better, other.better),
        )  # fmt: skip


def _judged(costs: Sequence[float], bound: float, cost: float) -> Judged:
    """Statistics of competitors' ``costs`` (minimised; inf if infeasible)."""
    kept = [c for c in costs if math.isfinite(c)]
    best = min(kept, default=math.inf)
    return Judged(len(costs), len(kept), max(bound / best - 1.0, 0.0), max(cost / best - 1.0, 0.0))


# Pins -----------------------------------------------------------------------------------------------------------------


def pin_keeps(check: pin.PinCheck, outer: float, limits: pin.Limits, slack: float = _FEASIBILITY_TOLERANCE) -> bool:
    """Whether a checked pin of this outer diameter [m] satisfies strength and limits."""
    g = check.along.bore
    wanted = [(check.strength_utilisation, 1.0), (check.deflection, limits.max_deflection)]
    if limits.max_ovalization is not None:
        wanted.append((None if check.ring is None else check.ring.ovalization_max, limits.max_ovalization))
    if any(limit is not None and (value is None or value > limit * (1.0 + slack)) for value, limit in wanted):
        return False
    if limits.max_slope is not None:
        rise, run = np.abs(np.diff(g)), np.diff(check.along.x)
        if np.any(rise > limits.max_slope * run * (1.0 + 1e-6) + 1e-12 * g.max()):
            return False
    return 0.5 * (outer - g.max()) >= limits.min_wall * (1.0 - slack)


def pin_neighbours(problem: pin.PinProblem, accuracy: float = 1e-8, steps: Sequence[float] = STEPS) -> Judged:
    """Answers with each limit relaxed or tightened, compared with the answer."""
    own = pin.design(problem, accuracy=accuracy)
    judged, outer = Judged(), problem.scene.geometry.outer_diameter
    if own.value is None:
        return judged
    for name in PIN_LIMITS:
        limit = getattr(problem.limits, name)
        if not limit:
            continue
        for step in steps:
            for factor in (1.0 + step, 1.0 / (1.0 + step)):
                other = replace(problem, limits=replace(problem.limits, **{name: limit * factor}))
                found = pin.design(other, accuracy=accuracy)
                if found.value is None:
                    continue
                for (rival, _), (answer, asked) in (
                    ((found, other), (own, problem)), ((own, problem), (found, other))
                ):  # fmt: skip
                    keeps = pin_keeps(rival.value.check, outer, asked.limits)
                    judged |= _judged(
                        [rival.value.check.mass if keeps else math.inf], answer.certificate.bound,
                        answer.value.check.mass,
                    )  # fmt: skip
    return judged


def _corners(problem: pin.PinProblem, outcome: Outcome[pin.PinDesign]) -> tuple[np.ndarray, np.ndarray]:
    """Positions and bores that define a competitor's shape over one half."""
    middle = 0.5 * problem.scene.geometry.length
    if outcome.value.corners is not None:
        x, bore = np.array(outcome.value.corners).T
    else:
        x, bore = outcome.value.check.along.x, outcome.value.check.along.bore
    first = x <= middle * (1.0 + 1e-12)
    return x[first], bore[first]


def pin_climbed(
    problem: pin.PinProblem, outcome: Outcome[pin.PinDesign], rng: np.random.Generator, starts: int, evaluations: int
) -> Judged:
    """SLSQP and Nelder-Mead on the check of a symmetric pin.

    Variables are the sizes at the shape's corners, with the inner positions of steps and cones, or a piecewise linear
    perturbation of a free bore.
    """
    x, bore = _corners(problem, outcome)
    scene, middle = problem.scene, 0.5 * problem.scene.geometry.length
    outer, told = scene.geometry.outer_diameter, outcome.value.corners is not None
    places, at = np.unique(x, return_inverse=True)
    # Equal cylinders share a variable; a cone's corners are independent.
    first = np.unique(x, return_index=True)[1]
    sizes, like = (bore[first], at) if isinstance(problem.form, pin.Cone) else np.unique(bore, return_inverse=True)
    inner = np.flatnonzero((places > 0.0) & (places < middle * (1.0 - 1e-9))) if told else np.zeros(0, int)
    knots = np.linspace(0.0, middle, 7)
    count = sizes.size if told else knots.size
    costs: list[float] = []

    def profile(p: np.ndarray) -> pin.Profile:
        wall, moved = p[:count], p[count:]
        if told:
            at_places = places.copy()
            at_places[inner] *= 1.0 + moved
            bores, xs = (outer - (outer - sizes) * (1.0 + wall))[like], np.maximum.accumulate(at_places[at])
        else:
            bores, xs = outer - (outer - bore) * (1.0 + np.interp(x, knots, wall)), x
            if problem.form.name == "drillable":
                bores = np.minimum.accumulate(bores)
        return pin.Profile(tuple(np.clip(xs, 0.0, middle).tolist()), tuple(np.clip(bores, 0.0, outer).tolist()))

    def look(p: np.ndarray) -> tuple[float, float]:
        """Mass relative to the answer's, and the largest relative violation (negative: margin)."""
        check = pin.check(scene, profile(p), problem.criterion, problem.limits, accuracy=1e-7).value
        limits, missed = problem.limits, [(check.strength_utilisation or 1e3) - 1.0]
        if limits.max_deflection is not None:
            missed.append((check.deflection or 1e3) / limits.max_deflection - 1.0)
        if limits.max_ovalization is not None:
            most = check.ring.ovalization_max if check.ring is not None else None
            missed.append((most or 1e3) / limits.max_ovalization - 1.0)
        keeps = pin_keeps(check, outer, limits)
        costs.append(check.mass if keeps else math.inf)
        if not keeps:
            missed.append(1e-9)
        return check.mass / outcome.value.check.mass, max(missed)

    size = count + inner.size
    for start in range(starts):
        first = rng.uniform(-1.0, 1.0, size) * (0.0 if start == 0 else 10.0 ** rng.uniform(-4.0, -1.5))
        minimize(
            lambda p: look(p)[0], first, method="SLSQP", options={"maxiter": max(evaluations // (size + 1), 3)},
            constraints=[{"type": "ineq", "fun": lambda p: -look(p)[1]}],
        )  # fmt: skip
        minimize(
            lambda p: (lambda mass, missed: mass + 30.0 * max(missed, 0.0))(*look(p)), first, method="Nelder-Mead",
            options={"maxfev": evaluations, "initial_simplex": _simplex(first)},
        )  # fmt: skip
    return _judged(costs, outcome.certificate.bound, outcome.value.check.mass)


def _simplex(first: np.ndarray) -> np.ndarray:
    return np.vstack([first, first + 1e-3 * np.eye(first.size)])


# Linkages -------------------------------------------------------------------------------------------------------------


def _cost(problem: linkage.LinkageProblem, value: float) -> float:
    return value if problem.objective.sign > 0 else 1.0 / value


def linkage_neighbours(problem: linkage.LinkageProblem, accuracy: float = 1e-6) -> Judged:
    """Answers with each limit relaxed or tightened, compared with the answer by their checked values."""
    own = linkage.design(problem, accuracy=accuracy)
    judged = Judged()
    if own.value is None:
        return judged
    for name in LINKAGE_LIMITS:
        limit = getattr(problem.limits, name)
        if limit is None:
            continue
        for step in STEPS:
            for factor in (1.0 + step, 1.0 / (1.0 + step)):
                other = replace(problem, limits=replace(problem.limits, **{name: limit * factor}))
                found = linkage.design(other, accuracy=accuracy)
                if found.value is None:
                    continue
                for rival, answer, asked in ((found, own, problem), (own, found, other)):
                    keeps = linkage_keeps(rival.value.check, asked.limits)
                    cost = _cost(problem, rival.value.value) if keeps else math.inf
                    judged |= _judged(
                        [cost], _cost(problem, answer.certificate.bound), _cost(problem, answer.value.value)
                    )
    return judged


def linkage_keeps(check: linkage.LinkageCheck, limits: linkage.Limits) -> bool:
    """Whether a checked linkage satisfies every limit."""
    lengths = check.mechanism.lengths
    links = lengths.base, lengths.crank, lengths.coupler, lengths.rocker
    most = [
        (max(links), limits.longest_link), (check.enclosing_radius, limits.enclosing_radius),
        (None if check.box is None else check.box.width, limits.width),
        (None if check.box is None else check.box.height, limits.height),
        (None if check.strike is None else check.strike.peaks.force, limits.max_pin_force),
    ]  # fmt: skip
    if check.strike is None or min(links) < limits.min_link * (1.0 - _FEASIBILITY_TOLERANCE):
        return False
    if any(
        limit is not None and (value is None or value > limit * (1.0 + _FEASIBILITY_TOLERANCE)) for value, limit in most
    ):
        return False
    least, greatest = limits.transmission_angle or (0.0, math.pi)
    return least - 1e-9 <= check.strike.transmission_angle <= greatest + 1e-9


def linkage_scanned(
    problem: linkage.LinkageProblem, outcome: Outcome[linkage.LinkageDesign], read: Callable[[object], float],
    pieces: int, evaluations: int,
) -> Judged:  # fmt: skip
    """Scan every type over its free ratio, far beyond the design range, by Brent's bounded search per subinterval.

    For given speed and frequency without a tool, where the ratio determines the size. ``read`` maps a checked linkage
    to its objective.
    """
    costs: list[float] = []
    scene, beyond = problem.scene, math.log(FURTHER)
    for kind in problem.kinds:
        family = Family(kind, scene.restitution.gain)
        low, high = family.range

        def look(q: float, family: Family = family, kind: linkage.ChangePoint = kind) -> float:
            bar = family.member(q)
            crank = problem.fixed_scale / (float(bar.ratios.rocker) * bar.end)
            check = linkage.check(
                scene, linkage.Mechanism(bar, crank, Closure(kind, 0.0, 0.0)), problem.limits,
                demands=problem.demands(),
            ).value  # fmt: skip
            value = read(check)
            costs.append(_cost(problem, value) if linkage_keeps(check, problem.limits) else math.inf)
            return costs[-1] if math.isfinite(costs[-1]) else 1e9 * _cost(problem, value)

        ends = np.linspace(low - 0.5 * beyond, high + 0.5 * beyond, pieces + 1)
        for begin, end in pairwise(ends):
            minimize_scalar(look, bounds=(begin, end), method="bounded", options={"maxiter": evaluations})
    return _judged(costs, _cost(problem, outcome.certificate.bound), _cost(problem, outcome.value.value))
