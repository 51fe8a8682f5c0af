"""Global optimum of a one-parameter family of linkages, with a certified lower bound.

The free ratio is sampled and the best sample refined without derivatives (the cost may have kinks). Branch and bound
over the whole range of the free ratio then proves that no member is better by more than the gap: a subinterval is
discarded if its bounds (``range_bounds``) show that it contains no feasible member, or none cheaper than the incumbent.

A design stays away from the ends of the family (the parallelogram, infinitely long links); the proof does not. It
covers both tails up to where every quantity has converged to a relative 1e-8, except those that grow without bound, as
sizes do, and are then costly. (Costs that decrease with them indefinitely are rejected beforehand: ``unbounded``.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solvers.linkage.optimum.family import Family
from solvers.linkage.optimum.member_quantities import MemberQuantities
from solvers.linkage.optimum.range_bounds import RangeBounds
from solvers.linkage.problem import Quantities, Subproblem
from solvers.numerics.arrays import Array

_SAMPLES = 57
_CELLS = 24
_POINTS = 25
_PARTS = 6
_ROUNDS = 24
_MAX_CELLS = 160_000
_TAIL_CELLS, _TAIL_GAP = 8, 1e-4
"""Initial number of subintervals in the tails beyond the design range, and the gap to which a tail optimum is
proven."""
_TAIL_TOLERANCE = 1e-8
_MIN_TAIL_GAIN = 5e-3
"""Minimum relative gain for which a design outside the design range is returned."""
_MIN_WIDTH = 1e-11
_OTHER_TYPES_GAP = 1e-3
"""Maximum gap of the proof for types other than the best one."""
_COARSE, _FINE = 1e-4, 1e-13
_MAX_ITERATIONS, _SHARE = 40, 1e-5
"""Refinement stops when the minimiser's displacement, or the decrease of the cost over two iterations, is below this
fraction of the gap."""
_ASIDE, _SLOW = 0.02, 0.2
_TRIALS = 24


@dataclass(frozen=True)
class Proven:
    """Best member: q, V [m], cost, certified lower bound of the cost (inf: infeasible), and the search statistics.

    ``q`` is None if no member is feasible. The bound also covers members outside the design range.
    """

    q: float | None = None
    scale: float = math.nan
    cost: float = math.inf
    bound: float = math.inf
    cells: int = 0

    @property
    def gap(self) -> float:
        """Relative gap between cost and lower bound."""
        return max(1.0 - self.bound / self.cost, 0.0) if self.q is not None else 0.0


def search_all(subproblem: Subproblem, families: Sequence[Family], gap: float) -> list[Proven]:
    """Best member of every family; the minimum of their bounds is valid for all families together.

    The best of all is proven to ``gap``, the best of every other family to at least ``_OTHER_TYPES_GAP``. The tails
    outside the design range are searched, as far as any quantity still changes, for members cheaper than the best
    within any range. They lower the bound, and the best of them is the family's answer if the design range has no
    feasible member or only considerably worse ones.
    """
    if subproblem.fixed_end is not None:
        return [_only_member(subproblem, family) for family in families]
    ranges = [_allowed_range(subproblem, family) for family in families]
    bests = [_best_of_samples(subproblem, *each, gap) for each in zip(families, ranges, strict=True)]
    least, found = min((cost for _, cost in filter(None, bests)), default=math.inf), []
    for family, limits, best in zip(families, ranges, bests, strict=True):
        found.append(_proven(subproblem, family, limits, best, least, math.inf, gap))
        least = min(least, found[-1].cost)
    for k, family in enumerate(families):
        for tail in family.tails:
            own, limits = found[k], _allowed_range(subproblem, tail)
            known, best = min(proven.cost for proven in found), None
            if own.q is None:
                known, best = math.inf, _best_of_samples(subproblem, tail, limits, gap, _TAIL_CELLS)
            beyond = _proven(subproblem, tail, limits, best, known, known, gap - 1.1 * _TAIL_TOLERANCE, _TAIL_CELLS)
            # Beyond the end of the tail no relevant quantity changes by more than this.
            bound, cells = min(own.bound, beyond.bound * (1.0 - _TAIL_TOLERANCE)), own.cells + beyond.cells
            within = own.q is not None and not beyond.cost < own.cost * (1.0 - _MIN_TAIL_GAIN)
            found[k] = replace(own if within else beyond, bound=bound, cells=cells)
    return found


def _best_of_samples(
    subproblem: Subproblem, family: Family, limits: tuple[float, float], gap: float, parts: int = _CELLS
) -> tuple[float, float] | None:
    """Refine the best of equally spaced samples: (q, cost), None if no sample is feasible."""
    if limits[0] > limits[1]:
        return None
    samples = np.linspace(*limits, _SAMPLES * parts // _CELLS)
    costs = _costs(subproblem, family, samples, _COARSE)
    top = int(np.argmin(costs))
    if not math.isfinite(costs[top]):
        return None
    return _refined(subproblem, family, samples[max(top - 1, 0) : top + 2], gap)


def _proven(
    subproblem: Subproblem, family: Family, limits: tuple[float, float], best: tuple[float, float] | None,
    known: float, sought: float, gap: float, parts: int = _CELLS,
) -> Proven:  # fmt: skip
    """Best member within limits of q and a lower bound, given the incumbent there and the best cost ``known`` overall.

    Without an incumbent, only costs below ``sought`` by more than the gap are searched for, and the bound is at most
    that.
    """
    low, high = limits
    if low > high:
        return Proven()
    edges = np.linspace(low, high, parts + 1)
    lows, highs, cells, bound = edges[:-1], edges[1:], 0, math.inf
    for turn in range(_ROUNDS):
        least = sought if best is None else best[1]
        if best is None or not math.isfinite(sought):
            enough = max(min(known, least) * (1.0 - gap), least * (1.0 - max(gap, _OTHER_TYPES_GAP)))
        else:
            enough = least * (1.0 - max(gap, _TAIL_GAP))
        bounds = _cost(RangeBounds(subproblem, family, lows, highs, enough))
        cells += lows.size
        alive = bounds < enough
        lows, highs, bounds = lows[alive], highs[alive], bounds[alive]
        if not lows.size:
            break
        if highs[0] - lows[0] < _MIN_WIDTH or cells + _PARTS * lows.size > _MAX_CELLS:
            # Subintervals this narrow that are neither feasible nor excluded differ from excluded ones by rounding
            # only.
            bound = min(bound, float(bounds.min())) if math.isfinite(least) else math.inf
            break
        if best is None or turn > 0:
            # The cheapest subintervals may all lie just outside a narrow feasible range: try the others as well.
            spread = np.linspace(0, lows.size - 1, _TRIALS).astype(int)
            tried = 0.5 * (lows + highs)[np.union1d(np.argsort(bounds)[:_TRIALS], spread)]
            width = float(highs[0] - lows[0])
            best = _refined_near(subproblem, family, limits, tried, width, least, gap) or best
        # Subdivide into several equal parts: a few large batches cost less than many small ones.
        edges = lows[:, None] + (highs - lows)[:, None] * np.linspace(0.0, 1.0, _PARTS + 1)
        edges[:, -1] = highs
        lows, highs = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    bound = min(bound, enough)
    if best is None:
        return Proven(bound=bound, cells=cells)
    return Proven(best[0], _scale(subproblem, family, best[0]), best[1], bound, cells)


def _only_member(subproblem: Subproblem, family: Family) -> Proven:
    """Given speed, frequency and tool radius there is at most one member."""
    q = family.margin_where(lambda members: members.end, subproblem.fixed_end)
    if q is None:
        return Proven()
    cost = float(_costs(subproblem, family, np.array([q]), _FINE)[0])
    if not math.isfinite(cost):
        return Proven(cells=1)
    return Proven(q, _scale(subproblem, family, q), cost, cost, 1)


def _allowed_range(subproblem: Subproblem, family: Family) -> tuple[float, float]:
    """Range of q by the limits that are monotone in it: nu(pi) and the crank per V decrease with q."""
    low, high = family.range
    ends = family.members(np.array([low, high]))
    if subproblem.limits.transmission_angle is not None:
        least, greatest = subproblem.limits.transmission_angle
        if ends.transmission[1] > greatest or ends.transmission[0] < least:
            return math.inf, -math.inf
        low, high = family.margin_of_transmission(greatest, low), family.margin_of_transmission(least, high)
    if subproblem.fixed_scale is not None and subproblem.limits.min_link > 0:
        crank = subproblem.limits.min_link / subproblem.fixed_scale
        if ends.lengths[0, 0] < crank:
            return math.inf, -math.inf
        high = min(family.margin_of_crank(crank, high), high)
    return low, high


def _scale(subproblem: Subproblem, family: Family, q: float) -> float:
    low, high = MemberQuantities(subproblem, family, np.array([q]), _FINE).scale
    return float(high[0] if subproblem.objective.grows else low[0])


def _cost(quantities: Quantities) -> Array:
    low, high = quantities.scale
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return np.where(low <= high, quantities.subproblem.objective.cost(quantities), np.inf)


def _costs(subproblem: Subproblem, family: Family, q: Array, tolerance: float) -> Array:
    return _cost(MemberQuantities(subproblem, family, q, tolerance))


def _refined(subproblem: Subproblem, family: Family, bracket: Array, gap: float) -> tuple[float, float] | None:
    """Minimise the cost within a bracket of increasing q: (q, cost), None if no point is feasible.

    If all costs around the best point are finite, the trials are the vertex of their parabola and the intersections of
    lines through two points on either side (a kink). Where a limit cuts the range off, or if these did not help, the
    trials are equally spaced.
    """
    q, costs, idle, even = bracket, _costs(subproblem, family, bracket, _FINE), 0, False
    for _ in range(_MAX_ITERATIONS):
        k = int(np.argmin(costs))
        low, high, least = q[max(k - 1, 0)], q[min(k + 1, q.size - 1)], costs[k]
        if idle == 2 or high - low <= _SHARE * gap * max(1.0, abs(high)):
            break
        near = slice(max(k - 2, 0), k + 3)
        even = even or not np.all(np.isfinite(costs[near]))
        points = np.linspace(low, high, _POINTS)[1:-1] if even else _trials(q[near], costs[near], min(k, 2))
        q, places = np.unique(np.concatenate([q[near], points]), return_index=True)
        costs = np.concatenate([costs[near], _costs(subproblem, family, points, _FINE)])[places]
        idle = idle + 1 if not even and least - costs.min() <= _SHARE * gap * abs(least) else 0
        k = int(np.argmin(costs))
        even = q[min(k + 1, q.size - 1)] - q[max(k - 1, 0)] > _SLOW * (high - low)
    k = int(np.argmin(costs))
    return (float(q[k]), float(costs[k])) if math.isfinite(costs[k]) else None


def _trials(q: Array, costs: Array, k: int) -> Array:
    """Trial minimisers of a function from up to two points on either side of the best one, the k-th."""
    low, here, high = q[max(k - 1, 0)], q[k], q[min(k + 1, q.size - 1)]
    width = high - low
    tried = [here]
    if low < here < high:
        left, right = (here - low) * (costs[k + 1] - costs[k]), (high - here) * (costs[k - 1] - costs[k])
        if left + right > 0.0:
            tried[0] = here + 0.5 * ((high - here) * right - (here - low) * left) / (left + right)
        for left, right in ((k - 2, k), (k - 1, k + 1)):
            # Lines through (left, left + 1) and (right, right + 1); the best point lies on one of them.
            if left >= 0 and right + 1 < q.size:
                falling = (costs[left + 1] - costs[left]) / (q[left + 1] - q[left])
                rising = (costs[right + 1] - costs[right]) / (q[right + 1] - q[right])
                if rising > falling:
                    tried.append(
                        q[left] + (costs[right] - costs[left] - rising * (q[right] - q[left])) / (falling - rising)
                    )
    tried += [tried[0] - _ASIDE * width, tried[0] + _ASIDE * width, 0.5 * (low + here), 0.5 * (here + high)]
    return np.setdiff1d(np.clip(tried, low, high), q)


def _refined_near(
    subproblem: Subproblem, family: Family, limits: tuple[float, float], points: Array, width: float, known: float,
    gap: float,
) -> tuple[float, float] | None:  # fmt: skip
    """Refine the best of the points; None unless it improves on the known cost by more than rounding."""
    costs = _costs(subproblem, family, points, _COARSE if math.isfinite(known) else _FINE)
    k = int(np.argmin(costs))
    if not costs[k] < known * (1.0 - 1e-9):
        return None
    bracket = np.unique(np.clip([points[k] - width, points[k], points[k] + width], *limits))
    found = _refined(subproblem, family, bracket, gap)
    return found if found is not None and found[1] < known else None
