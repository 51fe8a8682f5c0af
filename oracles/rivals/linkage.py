"""Competitors of a linkage design: all allowed types over their free ratio, and over size if free, by scans and local
searches that only use the check.

The free ratio is min (1 + m). Designs keep m within ``Family.design_range``; competitors go a thousand times closer to
both ends, because the certificate covers those as well. Linkages without the requested restitution do not compete; all
that have it belong to these families.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from oracles.rivals.hunt import Array, Hunt, Look, Space, Spent
from oracles.rivals.starts import Strength, along, compete, step_along_limits
from solvers import linkage
from solvers.linkage.mechanism.kinematics import FourBar
from solvers.linkage.optimum.family import Family

_BEYOND = 1e3
"""Factor by which the range is extended toward its ends."""
_SIZES = 1e3
"""Range of sizes relative to the answer, if the size is free."""
_BEST_OF_SCAN = 3
_LEAST_ANGLE = 1e-9


def _links(check: linkage.LinkageCheck) -> tuple[float, float, float, float]:
    return check.mechanism.lengths.links


def cost_of(problem: linkage.LinkageProblem, value: float) -> float:
    """Logarithm of the objective as minimised."""
    return problem.objective.sign * math.log(value)


def look_at(problem: linkage.LinkageProblem, bar: FourBar, scale: float) -> Look:
    """Evaluate a member at a given size."""
    scene = problem.settled(scale, bar.u31_end)
    mechanism = linkage.Mechanism(bar, scale / (float(bar.ratios.rocker) * bar.u31_end))
    found = linkage.check(scene, mechanism, problem.limits, _needed(problem), demands=problem.demands()).value
    kept = margins(problem.limits, found)
    if found.strike is None or found.strike.peaks is None:
        return Look(math.inf, kept)
    return Look(cost_of(problem, problem.objective.read(found, scene)), kept)


def _needed(problem: linkage.LinkageProblem) -> linkage.EffectSelection:
    """The effects required by limits and objective; the others do not change these results."""
    needed = frozenset(demand.effect for demand in problem.demands())
    return linkage.EffectSelection(needed, frozenset(effect.name for effect in linkage.EFFECTS) - needed)


def margins(limits: linkage.Limits, found: linkage.LinkageCheck) -> Array:
    """Logarithmic margins of the limits; NaN for missing results."""
    out = [1.0 if found.mechanism.rotatable else math.nan]
    if limits.min_link > 0.0:
        out.append(math.log(min(_links(found)) / limits.min_link))
    stands = found.strike is not None and found.strike.peaks is not None
    most = (
        (limits.longest_link, lambda: max(_links(found))),
        (limits.enclosing_radius, lambda: found.enclosing_radius),
        (limits.width, lambda: found.box.width),
        (limits.height, lambda: found.box.height),
        (limits.max_pin_force, lambda: found.strike.peaks.force),
    )
    out += [math.log(limit / read()) if stands else math.nan for limit, read in most if limit is not None]
    if limits.transmission_angle is not None:
        least, greatest = limits.transmission_angle
        angle = max(found.mechanism.bar.middle_transmission_angle, _LEAST_ANGLE) if stands else math.nan
        out += [math.log(angle / max(least, _LEAST_ANGLE)), math.log(greatest / angle) if greatest > 0.0 else math.nan]
    return np.array(out)


@dataclass(frozen=True)
class Way:
    """A type's members: bounds of (m, V), or of the free one, and the member for each value."""

    family: Family
    space: Space
    member: Callable[[Array], tuple[FourBar, float]]


def ways(problem: linkage.LinkageProblem, scale: float) -> Iterator[Way]:
    """All types; ``scale`` is the answer's V [m], or the centre of the size range."""
    for kind in problem.kinds:
        family = Family(kind, problem.scene.restitution.gain)
        low, high = (math.exp(end) for end in family.design_range)
        ends, sizes = (low / _BEYOND, high * _BEYOND), (scale / _SIZES, scale * _SIZES)
        if problem.fixed_scale is not None:
            yield _way(family, (ends,), lambda p, f=family: (f.member(math.log(p[0])), problem.fixed_scale))
        elif problem.fixed_u31_end is not None:
            at = family.solve(lambda bar: bar.u31_end, problem.fixed_u31_end, *family.design_range)
            if at is not None:
                bar = family.member(at)
                yield _way(family, (sizes,), lambda p, bar=bar: (bar, float(p[0])))
        else:
            yield _way(family, (ends, sizes), lambda p, f=family: (f.member(math.log(p[0])), float(p[1])))


def _way(family: Family, ends: tuple[tuple[float, float], ...], member: Callable) -> Way:
    return Way(family, Space(*np.array(ends).T), member)


@dataclass(frozen=True)
class Best:
    """Result of a search within one type: the lowest cost, None if nothing is feasible."""

    cost: float | None
    kind: str
    found_by: str
    tried: int


def rivals(
    problem: linkage.LinkageProblem,
    answer: linkage.LinkageDesign | None,
    strength: Strength,
    rng: np.random.Generator,
    scan: int = 40,
) -> Iterator[Best]:
    """The best of every type: a scan of ``scan`` members with refinement, steps along the limits, and local searches
    from the answer and others; ``strength`` is shared among the types."""
    bar, scale = None, problem.scene.impact_speed / problem.scene.crank_speed
    if answer is not None:
        bar = answer.check.mechanism.bar
        scale = answer.check.mechanism.crank * float(bar.ratios.rocker) * bar.u31_end
    found = list(ways(problem, scale))
    starts = max(strength.starts // max(len(found), 1), _BEST_OF_SCAN + 2)
    for way in found:
        hunt = Hunt(way.space, lambda p, way=way: look_at(problem, *way.member(p)), seeking=answer is not None)
        near = []
        if bar is not None and bar.kind == way.family.kind:
            near.append(hunt.clipped(_told(problem, way, bar, scale)))
            step_along_limits(hunt, near[0])
            near += along(hunt, near[0], rng, max(starts // 4, 1))
        far = _scanned(hunt, scan, rng)
        low, high = np.log(way.space.lower), np.log(way.space.upper)
        far += [rng.uniform(low, high) for _ in range(starts - len(near) - len(far))]
        compete(hunt, near, far, replace(strength, starts=starts, most=strength.most // len(found)))
        yield Best(hunt.best and hunt.best[0], way.family.kind.name, hunt.found_by, hunt.evaluations)


def _told(problem: linkage.LinkageProblem, way: Way, bar: FourBar, scale: float) -> Array:
    """The answer's parameters."""
    kind, gain = way.family.kind, way.family.gain
    ratio = float(getattr(bar.ratios, _RATIO[kind.parameter]))
    beyond = math.log(max(ratio / kind.parameter_limit(gain) - 1.0, way.space.lower[0]))
    if problem.fixed_scale is not None:
        return np.array([beyond])
    return np.array([math.log(scale)] if problem.fixed_u31_end is not None else [beyond, math.log(scale)])


_RATIO = {"lambda0": "base", "lambda2": "coupler"}


def _scanned(hunt: Hunt, count: int, rng: np.random.Generator) -> list[Array]:
    """The best of many sampled members; with a single free parameter, refined between its neighbours."""
    low, high = np.log(hunt.space.lower), np.log(hunt.space.upper)
    grid = low + (high - low) * rng.uniform(0.0, 1.0, (count, low.size))
    if low.size == 1:
        grid = np.linspace(low, high, count)
    hunt.allow(10 * count, "a scan")
    merits = [hunt.merit(p) for p in grid]
    best = [int(i) for i in np.argsort(merits)[:_BEST_OF_SCAN]]
    if low.size == 1:
        for i in best:
            ends = float(grid[max(i - 1, 0)][0]), float(grid[min(i + 1, count - 1)][0])
            try:
                minimize_scalar(
                    lambda q: hunt.merit(np.array([q])), bounds=ends, method="bounded", options={"maxiter": 25}
                )
            except Spent:
                break
    return [grid[i] for i in best]
