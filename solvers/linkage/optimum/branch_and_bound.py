"""Global optimum of a one-parameter family of linkages, with a certified lower bound.

Branch and bound over the free ratio: a subinterval is discarded if its bounds (``quantities``) show that it contains
no feasible member, or none cheaper than the best known one by more than the gap. Members are tried at midpoints of the
subintervals that remain, and the best is refined without derivatives (the cost may have kinks).

A design stays away from the ends of the family (the parallelogram, infinitely long links); the bound does not. It
covers both tails up to where every quantity has converged to a relative 1e-8, except those that grow without bound, as
sizes do, and are then costly. (Costs that decrease with them indefinitely are rejected beforehand: ``design``.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter

import numpy as np

from solvers.linkage.mechanism.lengths import Mechanism
from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.quantities import EXCESS, Quantities
from solvers.linkage.problem import LinkageProblem
from solvers.numerics.arrays import Array

_SUBINTERVALS, _TAIL_SUBINTERVALS, _PARTS = 24, 8, 6
"""Initial numbers of subintervals in the design range and in each tail, and of the parts into which one is divided."""
_TRIALS = 12
"""Members evaluated per iteration: this many of the cheapest subintervals, and as many of the others."""
_MAX_SUBINTERVALS = 160_000
_MIN_WIDTH, _TAIL_WIDTH = 1e-11, 0.01
"""Widths below which subintervals are not divided further; the second applies in tails without a notable gain."""
_ROUNDING = 1e-9
"""Minimum relative gain for which a trial is refined."""
_BEYOND = 1e-8
"""Beyond the ends of the tails no relevant quantity changes by more than this, relative."""
_MIN_TAIL_GAIN = 5e-3
"""Minimum relative gain for which a design outside the design range is returned."""
_OTHER_TYPES_GAP = 1e-3
"""Maximum gap of the proof for types other than the best one."""
_EVENLY_SPACED, _OFFSET = np.arange(1, 8) / 8.0, 1e-3
"""Trial points of a refinement, relative to the bracket: evenly spaced ones, and the offset of an estimate's
neighbours."""
_FLAT = 1e-11
"""Refinement ends where the best cost and its neighbours agree to this relative difference."""


@dataclass(frozen=True)
class FamilyOptimum:
    """Best member: q, V [m], cost, certified lower bound of the cost (inf: infeasible), and number of subintervals.

    ``q`` is None if no member is feasible. The bound also covers members outside the design range.
    """

    family: Family
    q: float | None = None
    scale: float = math.nan
    cost: float = math.inf
    bound: float = math.inf
    cells: int = 0

    @cached_property
    def mechanism(self) -> Mechanism | None:
        """The best member, sized."""
        if self.q is None:
            return None
        bar = self.family.member(self.q)
        return Mechanism(bar, self.scale / (bar.ratios.rocker * bar.u31_end))


def search_all(problem: LinkageProblem, gap: float) -> list[FamilyOptimum]:
    """The best member of every allowed type, the best of all proven to the ``gap``."""
    found: list[FamilyOptimum] = []
    for kind in problem.kinds:
        known = min((other.cost for other in found), default=math.inf)
        found.append(search(problem, Family(kind, problem.scene.restitution.gain), gap, known))
    return found


def search(
    problem: LinkageProblem,
    family: Family,
    gap: float,
    known: float = math.inf,
    ends: tuple[float, float] | None = None,
) -> FamilyOptimum:
    """Best member of a family between two ends of q (``Family.design_range``), and a lower bound of the cost of all.

    Another family has a member of cost ``known``: this one is proven to be best to the relative ``gap`` if it is
    cheaper, otherwise to ``_OTHER_TYPES_GAP``, and the bound is that of both families. Designs are searched for in the
    tails too if feasible members are found there first, or considerably better ones; slightly better ones only lower
    the bound.
    """
    low, high = _allowed_range(problem, family)
    if low > high:
        return FamilyOptimum(family)
    if low == high:
        ends = low, high
    first, last = np.clip((low, high), *(ends or family.design_range))
    tails = np.linspace(low, first, _TAIL_SUBINTERVALS + 1), np.linspace(last, high, _TAIL_SUBINTERVALS + 1)
    edges = np.unique(np.concatenate([*tails, np.linspace(first, last, _SUBINTERVALS + 1)]))
    lows, highs, bounds = edges[:-1], edges[1:], np.zeros(edges.size - 1)
    # Limits that an answer just meets may leave one end of the range only.
    q, cost = min(zip((first, last), _costs(problem, family, np.array([first, last])), strict=True), key=itemgetter(1))
    bound, sought, cells = math.inf, cost, 1
    while lows.size:
        widths = highs - lows
        # The cheapest subintervals may all lie just outside a narrow feasible range: try others as well.
        tried = np.append(np.argsort(bounds)[:_TRIALS], np.arange(_TRIALS) * (lows.size - 1) // (_TRIALS - 1))
        middles = 0.5 * (lows + highs)[tried]
        costs = _costs(problem, family, middles)
        inside = np.where((middles >= first) & (middles <= last), costs, np.inf)
        k = int(np.argmin(inside))
        if inside[k] < cost * (1.0 - _ROUNDING):
            near = np.clip(middles[k] + widths[tried[k]] * np.array([-1.0, 0.0, 1.0]), first, last)
            q, cost = min((q, cost), _minimise(problem, family, np.unique(near)), key=itemgetter(1))
        rival = min(known, cost) if math.isfinite(cost) else cost
        if np.min(costs) < rival * (1.0 - _MIN_TAIL_GAIN) and ends is None:
            return search(problem, family, gap, known, family.proof_range)
        sought = rival * (1.0 - gap) * (1.0 + _BEYOND)
        cutoff = max(sought, cost * (1.0 - max(gap, _OTHER_TYPES_GAP)))
        bounds = Quantities(problem, family, lows, highs, cutoff).cost
        cells += lows.size
        outside = (highs <= first) | (lows >= last)
        alive = bounds < np.where(outside, sought, cutoff)
        slight = outside & (widths < _TAIL_WIDTH) & (bounds >= rival * (1.0 - _MIN_TAIL_GAIN))
        # Subintervals this narrow that are neither feasible nor excluded differ from excluded ones by rounding only.
        done = alive & (slight | (widths < _MIN_WIDTH))
        if cells + _PARTS * np.count_nonzero(alive) > _MAX_SUBINTERVALS:
            done = alive
        bound = np.min(bounds[done], initial=bound)
        alive &= ~done
        lows, widths, bounds = lows[alive], widths[alive], bounds[alive]
        # Subdivide into several equal parts: a few large batches cost less than many small ones.
        edges = lows[:, None] + widths[:, None] * np.arange(_PARTS + 1) / _PARTS
        edges[:, -1] = highs[alive]
        lows, highs, bounds = edges[:, :-1].ravel(), edges[:, 1:].ravel(), np.repeat(bounds, _PARTS)
    if not math.isfinite(cost):
        return FamilyOptimum(family, cells=cells)
    both_ends = np.array([q])
    member = Quantities(problem, family, both_ends, both_ends)
    scale = member.greatest[0] if problem.objective.improves_with_scale else member.sizes[0][0]
    return FamilyOptimum(family, q, float(scale), cost, min(float(bound), sought) * (1.0 - _BEYOND), cells)


def _allowed_range(problem: LinkageProblem, family: Family) -> tuple[float, float]:
    """Range of q within the limits on quantities monotone in q: nu(pi) and the crank per V decrease with it.

    A single member if speed, frequency and tool radius determine |u31(2 pi)|.
    """
    low, high = family.proof_range
    if problem.fixed_u31_end is not None:
        q = family.solve(lambda bar: bar.u31_end, problem.fixed_u31_end, low, high)
        return (math.inf, -math.inf) if q is None else (q, q)
    if problem.limits.transmission_angle is not None:
        low, high = family.subrange(lambda bar: bar.middle_transmission_angle, *problem.limits.transmission_angle)
    if problem.fixed_scale is not None and problem.limits.min_link > 0:
        crank = problem.limits.min_link / problem.fixed_scale * (1.0 - EXCESS)
        first, last = family.subrange(lambda bar: 1.0 / (bar.ratios.rocker * bar.u31_end), crank, math.inf)
        low, high = max(low, first), min(high, last)
    return low, high


def _costs(problem: LinkageProblem, family: Family, q: Array) -> Array:
    return Quantities(problem, family, q, q).cost


def _minimise(problem: LinkageProblem, family: Family, q: Array) -> tuple[float, float]:
    """Minimise the cost within a bracket of increasing q, its ends included: (q, cost), cost inf if none is feasible.

    The best point and its neighbours form the next bracket. Trials are evenly spaced, for costs that a limit cuts off,
    and around two estimates of the minimiser, which is often at a kink.
    """
    costs = _costs(problem, family, q)
    while True:
        k = int(np.argmin(costs))
        near = slice(max(k - 2, 0), k + 3)
        q, costs, k = q[near], costs[near], min(k, 2)
        low, high = max(k - 1, 0), min(k + 1, q.size - 1)
        flat = max(costs[low], costs[high]) - costs[k] <= _FLAT * abs(costs[k])
        if flat or q[high] - q[low] <= _MIN_WIDTH * max(1.0, abs(q[k])):
            return float(q[k]), float(costs[k])
        trials = np.append(q[low] + (q[high] - q[low]) * _EVENLY_SPACED, _estimated_minimisers(q, costs, k))
        trials = np.clip(trials, q[low], q[high])
        q, places = np.unique(np.append(q, trials), return_index=True)
        costs = np.append(costs, _costs(problem, family, trials))[places]


def _estimated_minimisers(q: Array, costs: Array, k: int) -> Array:
    """Estimated minimisers with near neighbours: the best of up to five points, the k-th; the vertex of the parabola
    through the inner three; the intersection of the lines through the outer pairs."""
    found = [q[k]]
    if q.size == 5 and np.all(np.isfinite(costs)):
        left, right = (q[2] - q[1]) * (costs[3] - costs[2]), (q[3] - q[2]) * (costs[1] - costs[2])
        falling, rising = (costs[1] - costs[0]) / (q[1] - q[0]), (costs[4] - costs[3]) / (q[4] - q[3])
        if rising > falling:
            found.append(q[2] + 0.5 * ((q[3] - q[2]) * right - (q[2] - q[1]) * left) / (left + right))
            found.append(q[0] + (costs[3] - costs[0] - rising * (q[3] - q[0])) / (falling - rising))
    return np.add.outer(found, _OFFSET * (q[-1] - q[0]) * np.array([-1.0, 0.0, 1.0])).ravel()
